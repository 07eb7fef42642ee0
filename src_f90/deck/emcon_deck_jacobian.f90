!> Where the Jacobian of elements is positive that have corners where it is not.
module emcon_deck_jacobian
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_kinds, only : wp
   use emcon_rotation, only : cross_product
   use emcon_scene, only : scene_t
   use emcon_shape, only : shape_t, shape_table_t, shape_tabulate
   implicit none
   private
   public :: determinant, is_integrable, refuse_shapes, warn_of_shapes, warn_of_corners

   integer, parameter :: n_space = 3
   !> Jacobian at a point, over the largest one, below which it is round-off of the coordinates.
   real(wp), parameter :: least_part = 1.0e-10_wp

contains

   !> Is det dx/dxi positive at all points of quadrature, of stiffness and of mass? All that is
   !> computed of an element is computed there.
   pure logical function is_integrable(shape, x)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node) of the shape
      real(wp) :: least, most

      least = huge(least)
      most = 0.0_wp
      call take_range(shape, x, .true., least, most)
      call take_range(shape, x, .false., least, most)
      is_integrable = least > least_part*most
   end function is_integrable

   !> Widen the range of det dx/dxi to the points of one rule.
   pure subroutine take_range(shape, x, is_mass, least, most)
      class(shape_t), intent(in) :: shape
      real(wp), intent(in) :: x(:, :)            !! (n_dim, n_node)
      logical, intent(in) :: is_mass             !! the rule of mass, else of stiffness
      real(wp), intent(inout) :: least, most
      type(shape_table_t) :: table
      real(wp) :: det
      integer :: i

      call shape_tabulate(shape, is_mass, table)
      do i = 1, table%n_gp
         det = determinant(matmul(x, transpose(table%slope(:, :, i))))
         least = min(least, det)
         most = max(most, det)
      end do
   end subroutine take_range

   !> Of a matrix of the plane or of space.
   pure real(wp) function determinant(j)
      real(wp), intent(in) :: j(:, :)            !! (n_dim, n_dim)
      real(wp) :: a(n_space, n_space)
      integer :: n

      n = size(j, 1)
      a = 0.0_wp
      a(n_space, n_space) = 1.0_wp
      a(:n, :n) = j
      determinant = dot_product(a(:, n_space), cross_product(a(:, 1), a(:, n_space - 1)))
   end function determinant

   !> Such elements are computed, and told.
   subroutine warn_of_corners(reader, scene, is_bad)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_bad(:)           !! (n_element) has a corner without area or volume

      call warn_of_shapes(reader, scene, is_bad, " is folded at a corner: the Jacobian is not " &
         // "positive there, but at all points of integration; stresses near that corner are not " &
         // "reliable")
   end subroutine warn_of_corners

   !> Tell of elements, if there are some, what is wrong with them.
   subroutine warn_of_shapes(reader, scene, is_bad, text)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_bad(:)           !! (n_element)
      character(len=*), intent(in) :: text       !! behind the labels

      if (any(is_bad)) call add_warning(reader%log, scene%element%origin(findloc(is_bad, .true., &
         1)), "element " // label_list(pack(scene%element%label, is_bad)) // text)
   end subroutine warn_of_shapes

   !> The same as an error.
   subroutine refuse_shapes(reader, scene, is_bad, text)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_bad(:)           !! (n_element)
      character(len=*), intent(in) :: text       !! behind the labels

      if (.not. any(is_bad)) return
      reader%doubt%shapes = .true.
      call add_error(reader%log, scene%element%origin(findloc(is_bad, .true., 1)), "element " &
         // label_list(pack(scene%element%label, is_bad)) // text)
   end subroutine refuse_shapes

end module emcon_deck_jacobian
