!> What the log and `emcon check` tell of ties and equations: subdomains, interfaces, crosspoints,
!> and what elimination leaves.
module emcon_link_lines
   use emcon_couplings, only : tie_t
   use emcon_deck_dimension, only : n_plane
   use emcon_interactions, only : multiplier_dual
   use emcon_scene, only : scene_t
   use emcon_surface_facets, only : surface_facets
   use emcon_system, only : system_t
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   use emcon_tie_meetings, only : find_crosspoints
   implicit none
   private
   public :: add_link_lines

   !> Subdomains, and nodes of a crosspoint, that are named.
   integer, parameter :: most_subdomains = 100, most_nodes = 10

contains

   !> Add the lines to `notes`; none if the scene has no rigid bodies, ties or equations.
   subroutine add_link_lines(scene, system, notes)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(in) :: system
      type(notes_t), intent(inout) :: notes
      integer, allocatable :: node(:), place(:)
      character(len=:), allocatable :: text, crosspoints
      integer :: k, n_place

      if (system%space%linear%n == 0) return
      call find_crosspoints(scene, node, place, n_place)
      crosspoints = " crosspoints, "
      if (scene%n_dim /= n_plane) then
         n_place = size(node)                    ! along whole edges: as many as these have
         crosspoints = " nodes where ties meet, "
      end if
      call elimination_text(system, text)
      if (size(scene%rigid) > 0) text = to_text(size(scene%rigid)) // " rigid; " // text
      if (size(scene%node%turned) > 0) text = to_text(count(scene%node%turned%stand_in > 0)) // &
         " nodes held along axes of *TRANSFORM; " // text
      call note_add(notes, to_text(system%space%n_body) // " subdomains, " // &
         to_text(size(scene%tie)) // " ties, " // to_text(n_place) // crosspoints // &
         to_text(count(scene%equation%turned == 0)) // " equations; " // text)
      if (size(scene%tie) > 0) call add_subdomains(scene, system, notes)
      do k = 1, size(scene%tie)
         call tie_text(scene, scene%tie(k), text)
         call note_add(notes, "tie " // text)
      end do
      do k = 1, merge(n_place, 0, scene%n_dim == n_plane)
         call labels_text(scene, pack(node, place == k), text)
         call note_add(notes, "crosspoint " // to_text(k) // ": nodes " // text)
      end do
   end subroutine add_link_lines

   !> Unknowns without linear constraints, and with them.
   subroutine elimination_text(system, text)
      type(system_t), intent(in) :: system
      character(len=:), allocatable, intent(out) :: text

      associate (numbering => system%space%numbering)
         if (system%space%is_reduced) then
            text = to_text(numbering%n_unknown + numbering%n_dependent) // &
               " unknowns before, " // to_text(numbering%n_unknown) // " after elimination"
         else
            text = to_text(numbering%n_unknown) // " unknowns and " // &
               to_text(count(system%space%linear%is_used)) // " multipliers"
         end if
      end associate
   end subroutine elimination_text

   !> One line for each connected mesh.
   subroutine add_subdomains(scene, system, notes)
      type(scene_t), intent(in) :: scene
      type(system_t), intent(in) :: system
      type(notes_t), intent(inout) :: notes
      integer, dimension(system%space%n_body) :: n_node, n_element, first
      character(len=:), allocatable :: text
      integer :: i, b

      n_node = 0
      n_element = 0
      do i = 1, size(system%space%body)
         b = system%space%body(i)
         if (b > 0) n_node(b) = n_node(b) + 1
      end do
      do i = size(scene%element%kind), 1, -1
         b = system%space%body(scene%element%node(1, i))
         n_element(b) = n_element(b) + 1
         first(b) = scene%element%label(i)
      end do
      do b = 1, min(system%space%n_body, most_subdomains)
         text = "subdomain " // to_text(b) // ": "
         if (n_element(b) > 0) text = text // to_text(n_element(b)) // " elements from " // &
            to_text(first(b)) // " on, "
         call note_add(notes, text // to_text(n_node(b)) // " nodes")
      end do
   end subroutine add_subdomains

   !> Name, surfaces and multipliers of a tie.
   subroutine tie_text(scene, tie, text)
      type(scene_t), intent(in) :: scene
      type(tie_t), intent(in) :: tie
      character(len=:), allocatable, intent(out) :: text
      integer, allocatable :: slave(:, :), master(:, :)
      character(len=6) :: facets

      facets = merge(" edges", " faces", scene%n_dim == n_plane)
      call surface_facets(scene, scene%surface(tie%slave), slave)
      call surface_facets(scene, scene%surface(tie%master), master)
      text = tie%name // ": " // scene%surface(tie%slave)%name // " (slave, " // &
         to_text(size(slave, 2)) // facets // ") to " // &
         scene%surface(tie%master)%name // " (" // &
         to_text(size(master, 2)) // facets // "), " // &
         to_text(size(tie%rows%slave)) // " " // &
         trim(merge("dual    ", "standard", tie%multiplier == multiplier_dual)) // " multipliers"
   end subroutine tie_text

   subroutine labels_text(scene, node, text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node(:)
      character(len=:), allocatable, intent(out) :: text
      type(string_t) :: label(size(node))
      integer :: i

      do i = 1, size(node)
         label(i)%text = to_text(scene%node%label(node(i)))
      end do
      text = joined(label, ", ", most_nodes)
   end subroutine labels_text

end module emcon_link_lines
