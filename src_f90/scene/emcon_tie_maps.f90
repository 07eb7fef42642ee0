!> Where the master of a tie stands for its slave: moved by a translation, in a cell that repeats
!> itself, or turned about an axis, in a sector of a body of revolution.
module emcon_tie_maps
   use emcon_kinds, only : wp
   implicit none
   private
   public :: tie_map_t, tie_map_is_given, tie_map_place, tie_map_translate, tie_map_turn

   !> The image of a place x of the master is turn x + shift. Where the slave is tied to the master
   !> as it stands there is none.
   type :: tie_map_t
      real(wp), allocatable :: turn(:, :)        !! (n_dim, n_dim) a rotation
      real(wp), allocatable :: shift(:)          !! (n_dim) [L]
      !> A node: by its displacement the translation from the slave to the master grows; 0: none
      integer :: reference = 0
      !> The surface whose image is the master, while ties are prepared; else 0
      integer :: original = 0
   end type tie_map_t

contains

   elemental logical function tie_map_is_given(map)
      type(tie_map_t), intent(in) :: map

      tie_map_is_given = allocated(map%turn)
   end function tie_map_is_given

   pure function tie_map_place(map, x) result(image)
      type(tie_map_t), intent(in) :: map         !! given
      real(wp), intent(in) :: x(:)               !! (n_dim) [L]
      real(wp) :: image(size(x))

      image = matmul(map%turn, x) + map%shift
   end function tie_map_place

   !> The slave moved by `translation` lies on the master.
   pure subroutine tie_map_translate(map, translation)
      type(tie_map_t), intent(inout) :: map
      real(wp), intent(in) :: translation(:)     !! (n_dim) [L]
      integer :: a

      allocate(map%turn(size(translation), size(translation)), source=0.0_wp)
      do a = 1, size(translation)
         map%turn(a, a) = 1.0_wp
      end do
      map%shift = -translation
   end subroutine tie_map_translate

   !> The image of the master is turned by an angle about an axis, in the plane about a point.
   pure subroutine tie_map_turn(map, point, axis, angle)
      type(tie_map_t), intent(inout) :: map
      real(wp), intent(in) :: point(:)           !! (n_dim) on the axis [L]
      real(wp), intent(in) :: axis(3)            !! of length 1; in the plane the third one
      real(wp), intent(in) :: angle              !! [rad]
      real(wp) :: turn(3, 3)
      integer :: a, b, c

      do a = 1, 3
         b = 1 + mod(a, 3)
         c = 1 + mod(b, 3)
         turn(:, a) = (1.0_wp - cos(angle))*axis*axis(a)
         turn(a, a) = turn(a, a) + cos(angle)
         turn(b, a) = turn(b, a) + sin(angle)*axis(c)
         turn(c, a) = turn(c, a) - sin(angle)*axis(b)
      end do
      map%turn = turn(:size(point), :size(point))
      map%shift = point - matmul(map%turn, point)
   end subroutine tie_map_turn

end module emcon_tie_maps
