!> What is wrong with the surfaces of a tie in space, in words.
module emcon_tie_check_space
   use emcon_couplings, only : tie_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_length, facets_text
   use emcon_kinds, only : wp
   use emcon_nearest_space, only : nearest_t
   use emcon_scene, only : scene_t
   use emcon_text, only : joined, string_t, to_text
   use emcon_tie_cells_space, only : tie_cells_t
   use emcon_tie_sides_space, only : tie_sides_nearest, tie_sides_t, tie_sides_tolerance
   use emcon_tie_text, only : most_named, raise_shared, tie_text, tolerance_text
   implicit none
   private
   public :: tie_check_sides, tie_check_nodes, tie_check_cover

   !> Surfaces that overlap a bit where two of their pieces meet are no two layers.
   real(wp), parameter :: two_layers = 1.05_wp
   !> A face of which less than this part is covered sees no face of the master.
   real(wp), parameter :: unseen = 1.0e-3_wp
   character(len=*), parameter :: advice = "swap slave and master, leave the faces without " // &
      "partner out of the slave surface, or raise POSITION TOLERANCE", &
      default_text = "a tenth of the longer of two facing faces"

contains

   !> Both surfaces have faces, or the slave is one of nodes, and no node in common.
   pure subroutine tie_check_sides(scene, tie, sides, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_sides_t), intent(in) :: sides
      type(error_t), allocatable, intent(out) :: error

      associate (slave => sides%slave%facets, master => sides%master%facets)
         call raise_shared(scene, tie, [size(slave%node), master%n_facet], slave%node, &
            master%node, error)
      end associate
   end subroutine tie_check_sides

   !> No slave node is farther from the master than the tolerance.
   pure subroutine tie_check_nodes(scene, tie, sides, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_sides_t), intent(in) :: sides
      type(error_t), allocatable, intent(out) :: error
      type(nearest_t) :: nearest
      real(wp) :: distance(size(sides%slave%facets%node)), longer
      logical :: is_far(size(distance))
      integer :: k, i

      associate (slave => sides%slave%facets, master => sides%master)
         do k = 1, size(distance)
            call tie_sides_nearest(sides, sides%slave%at(:, k), nearest)
            distance(k) = sqrt(nearest%square)
            longer = facets_length(master%facets, master%split%facet(nearest%triangle))
            do i = slave%around_start(k), slave%around_start(k + 1) - 1
               longer = max(longer, facets_length(slave, slave%around(i)))
            end do
            is_far(k) = distance(k) > tie_sides_tolerance(sides, longer)
         end do
         if (.not. any(is_far)) return
         if (all(is_far)) then
            k = minloc(distance, 1)
            call raise(error, err_input, tie_text(scene, tie) // "slave surface " // &
               scene%surface(tie%slave)%name // " and master surface " // &
               scene%surface(tie%master)%name // ": the surfaces do not meet: slave node " // &
               to_text(scene%node%label(slave%node(k))) // ", the nearest one, is " // &
               to_text(distance(k)) // " from the master, the position tolerance is " // &
               trim(tolerance_text(tie, default_text)) &
               // "; move a body, or raise POSITION TOLERANCE")
         else
            call raise_nodes(scene, tie, pack(slave%node, is_far), pack(distance, is_far), &
               size(slave%node), error)
         end if
      end associate
   end subroutine tie_check_nodes

   !> Name the slave nodes that are too far off, with their distances.
   pure subroutine raise_nodes(scene, tie, node, distance, n_node, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      integer, intent(in) :: node(:)             !! too far off
      real(wp), intent(in) :: distance(:)        !! (size of node) [L]
      integer, intent(in) :: n_node              !! nodes of the slave
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: found(size(node))
      integer :: i

      do i = 1, size(node)
         found(i)%text = to_text(scene%node%label(node(i))) // " (" // to_text(distance(i)) // ")"
      end do
      call raise(error, err_input, tie_text(scene, tie) // to_text(size(node)) // " of " // &
         to_text(n_node) // " nodes of slave surface " // scene%surface(tie%slave)%name // &
         " are farther from master surface " // scene%surface(tie%master)%name // &
         " than the position tolerance (" // trim(tolerance_text(tie, default_text)) // &
         "); node (distance): " // joined(found, ", ", most_named) // "; " // advice)
   end subroutine raise_nodes

   !> Every slave facet is covered but for a strip as wide as the tolerance, and once only.
   subroutine tie_check_cover(scene, tie, sides, cells, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_sides_t), intent(in) :: sides
      type(tie_cells_t), intent(in) :: cells(:)          !! of the slave facets
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      logical :: is_open(size(cells))
      integer :: f

      text = tie_text(scene, tie) // "slave surface " // scene%surface(tie%slave)%name // &
         " and master surface " // scene%surface(tie%master)%name // ": "
      if (all(cells%covered <= unseen*cells%whole)) then
         call raise(error, err_input, text // "the surfaces are near, but their faces do not " // &
            "face each other: check the face labels")
         return
      end if
      do f = 1, size(cells)
         associate (length => facets_length(sides%slave%facets, f))
            is_open(f) = cells(f)%whole - cells(f)%covered > &
               min(0.5_wp*cells(f)%whole, length*tie_sides_tolerance(sides, length))
         end associate
      end do
      if (any(is_open)) then
         call raise_faces(scene, tie, sides, cells, is_open, error)
         return
      end if
      f = findloc(cells%most > two_layers, .true., 1)
      if (f == 0) return
      text = text // "two layers of the master lie in front of one face of the slave, "
      call add_face(scene, sides, f, text)
      call raise(error, err_input, text // "; leave one of them out of the master surface")
   end subroutine tie_check_cover

   !> Name the slave facets that are covered in part.
   subroutine raise_faces(scene, tie, sides, cells, is_open, error)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      type(tie_sides_t), intent(in) :: sides
      type(tie_cells_t), intent(in) :: cells(:)
      logical, intent(in) :: is_open(:)
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: found(count(is_open))
      integer :: f, n

      n = 0
      do f = 1, size(cells)
         if (.not. is_open(f)) cycle
         n = n + 1
         found(n)%text = ""
         call add_face(scene, sides, f, found(n)%text)
         found(n)%text = found(n)%text // ": " // &
            to_text(100.0_wp*cells(f)%covered/cells(f)%whole, 3) // " %"
      end do
      call raise(error, err_input, tie_text(scene, tie) // to_text(n) // " of " // &
         to_text(size(cells)) // " faces of slave surface " // scene%surface(tie%slave)%name // &
         " are not covered by master surface " // scene%surface(tie%master)%name // &
         ", but for a strip as wide as the position tolerance (" // &
         trim(tolerance_text(tie, default_text)) // "): " // &
         joined(found, "; ", most_named) // "; " // advice)
   end subroutine raise_faces

   !> Append which facet of the slave `f` is.
   subroutine add_face(scene, sides, f, text)
      type(scene_t), intent(in) :: scene
      type(tie_sides_t), intent(in) :: sides
      integer, intent(in) :: f
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: face

      call facets_text(sides%slave%facets, scene, f, face)
      text = text // face
   end subroutine add_face

end module emcon_tie_check_space
