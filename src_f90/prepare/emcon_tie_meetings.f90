!> Where ties meet each other, what is prescribed, and what they cover.
module emcon_tie_meetings
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_init, facets_length, facets_rim, facets_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t, where_text
   use emcon_surface_facets, only : faces_of_facets, surface_facets
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : to_text
   use emcon_tied_edges, only : tied_edges_find
   implicit none
   private
   public :: count_ties, find_crosspoints, find_held, check_repeated
   public :: uncover_exterior

contains

   !> A slave node in the middle of one tie cannot be a slave node of another.
   subroutine check_repeated(scene, error)
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(facets_t) :: slave
      integer, allocatable :: owner(:)
      logical, allocatable :: is_inner(:), is_rim(:)
      integer :: t, k

      allocate(owner(size(scene%x, 2)), source=0)
      allocate(is_inner(size(scene%x, 2)), source=.false.)
      do t = 1, size(scene%tie)
         call facets_init(slave, scene, scene%surface(scene%tie(t)%slave), error)
         if (allocated(error)) return
         is_rim = spread(.false., 1, size(slave%node))
         call facets_rim(slave, is_rim)
         do k = 1, size(slave%node)
            associate (node => slave%node(k))
               if (owner(node) > 0 .and. (is_inner(node) .or. .not. is_rim(k))) then
                  call raise(error, err_input, where_text(scene, scene%tie(t)%origin) // &
                     ": *TIE " // scene%tie(t)%name // " over-constrains the model: slave " // &
                     "node " // to_text(scene%node%label(node)) // " is a slave node of *TIE " &
                     // scene%tie(owner(node))%name // " already; let the surface be the " // &
                     "master of one of them")
                  return
               end if
               owner(node) = t
               is_inner(node) = is_inner(node) .or. .not. is_rim(k)
            end associate
         end do
      end do
   end subroutine check_repeated

   !> Number of sides of ties that each node takes part in: of one tie both only on its axis. A
   !> master that is an image counts at the nodes that it is of.
   pure subroutine count_ties(scene, n_tie)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: n_tie(:)      !! (n_node)
      integer, allocatable :: node(:)
      integer :: t, side, surface

      allocate(n_tie(size(scene%x, 2)), source=0)
      do t = 1, size(scene%tie)
         associate (tie => scene%tie(t))
            do side = 1, 2
               surface = tie%slave
               if (side == 2) surface = merge(tie%map%original, tie%master, tie%map%original > 0)
               call surface_nodes(scene, scene%surface(surface), node)
               n_tie(node) = n_tie(node) + 1
            end do
         end associate
      end do
   end subroutine count_ties

   !> Nodes at places where ends of several ties meet, and which of these places each is at.
   subroutine find_crosspoints(scene, node, place, n_place)
      type(scene_t), intent(in) :: scene
      integer, allocatable, intent(out) :: node(:)
      integer, allocatable, intent(out) :: place(:)      !! (size of `node`) 1..n_place
      integer, intent(out) :: n_place
      type(facets_t) :: facets
      type(error_t), allocatable :: error
      logical, allocatable :: is_rim(:)
      integer, allocatable :: n_tie(:)
      real(wp) :: reach(size(scene%x, 2))        !! half of the shortest facet at a rim; else 0
      integer :: t, side, k, i, j, f, surface

      call count_ties(scene, n_tie)
      reach = 0.0_wp
      do t = 1, size(scene%tie)
         do side = 1, 2
            surface = merge(scene%tie(t)%slave, scene%tie(t)%master, side == 1)
            call facets_init(facets, scene, scene%surface(surface), error)
            if (allocated(error)) cycle
            is_rim = spread(.false., 1, size(facets%node))
            call facets_rim(facets, is_rim)
            do k = 1, size(facets%node)
               if (.not. is_rim(k) .or. n_tie(facets%node(k)) == 1) cycle
               associate (around => facets%around(facets%around_start(k): &
                     facets%around_start(k + 1) - 1))
                  reach(facets%node(k)) = 0.5_wp*minval([(facets_length(facets, around(f)), &
                     f = 1, size(around))])
               end associate
            end do
         end do
      end do
      node = pack([(i, i = 1, size(reach))], reach > 0.0_wp)
      allocate(place(size(node)), source=0)
      n_place = 0
      do i = 1, size(node)
         do j = 1, i - 1
            if (norm2(scene%x(:, node(i)) - scene%x(:, node(j))) &
               < min(reach(node(i)), reach(node(j)))) place(i) = place(j)
         end do
         if (place(i) > 0) cycle
         n_place = n_place + 1
         place(i) = n_place
      end do
   end subroutine find_crosspoints

   !> Freedoms that are prescribed in some step.
   pure subroutine find_held(scene, is_held)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: is_held(:, :)     !! (n_dim, n_node)
      integer :: i, k

      allocate(is_held(size(scene%x, 1), size(scene%x, 2)), source=.false.)
      do i = 1, size(scene%step)
         associate (prescribed => scene%step(i)%prescribed)
            do k = 1, size(prescribed)
               is_held(prescribed(k)%dof, prescribed(k)%node) = .true.
            end do
         end associate
      end do
   end subroutine find_held

   !> Take the faces that ties cover out of all exterior.
   pure subroutine uncover_exterior(scene)
      type(scene_t), intent(inout) :: scene
      logical, allocatable :: is_tied(:), is_left(:)
      integer, allocatable :: facet(:, :), face(:)
      integer :: s

      do s = 1, size(scene%surface)
         if (.not. scene%surface(s)%is_exterior) cycle
         call surface_facets(scene, scene%surface(s), facet)
         call tied_edges_find(scene, facet, is_tied)
         call faces_of_facets(scene, scene%surface(s), face)
         associate (surface => scene%surface(s))
            is_left = spread(.false., 1, size(surface%face))
            is_left(pack(face, .not. is_tied)) = .true.
            surface%element = pack(surface%element, is_left)
            surface%face = pack(surface%face, is_left)
         end associate
      end do
   end subroutine uncover_exterior

end module emcon_tie_meetings
