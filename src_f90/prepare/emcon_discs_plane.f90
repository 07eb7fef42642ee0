!> Rigid circles that meet rigid surfaces: discs, each the centre of its circle with a pad as thick
!> as its radius.
!>
!> Corners of a rigid polygon land one by one, each an impact; a circle rolls. Source:
!> docs/theory.md, section 4.2.
module emcon_discs_plane
   use emcon_chain_plane, only : chain_init, chain_t
   use emcon_circles_plane, only : circle_whole, circles_find, circles_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_nts, pair_has_order, &
      pair_is_reverse_of, pair_of_one, smoothing_none
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_rigid_bodies, only : rigid_numbers
   use emcon_scene, only : scene_t, where_text
   use emcon_surface_facets, only : surface_facets
   use emcon_text, only : note_add, notes_t, to_text
   implicit none
   private
   public :: discs_prepare

   !> A node is the centre of a circle if it is nearer to it than this part of the radius.
   real(wp), parameter :: rounding = 1.0e-5_wp

contains

   !> Pairs that hold both sides of two rigid surfaces, one of them a circle, hold its centre from
   !> here on, and the notes tell. Not those that the deck asks sides of, or moves nodes in.
   subroutine discs_prepare(scene, notes)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      logical :: is_left(size(scene%pair)), is_disc
      integer :: body(size(scene%x, 2)), i, k

      if (size(scene%rigid) == 0 .or. size(scene%x, 1) /= 2) return
      if (any(scene%step%contact%options%smoothing /= smoothing_none)) return
      body = rigid_numbers(scene%rigid, size(body))
      is_left = .true.
      do i = 1, size(scene%pair)
         if (.not. may_roll(scene, scene%pair(i), body)) cycle
         k = findloc(pair_is_reverse_of(scene%pair, scene%pair(i)), .true., 1)
         if (k < i) cycle                        ! none, or looked at
         call take_disc(scene, i, body, notes, is_disc)
         is_left(k) = .not. is_disc
         if (is_disc) cycle
         call take_disc(scene, k, body, notes, is_disc)
         is_left(i) = .not. is_disc
      end do
      do k = 1, size(scene%guard)
         scene%guard(k)%of_pair = count(is_left(:scene%guard(k)%of_pair))
      end do
      scene%pair = pack(scene%pair, is_left)
   end subroutine discs_prepare

   !> Is a pair one of nodes and edges of both of two rigid surfaces, as the program chose?
   pure logical function may_roll(scene, pair, body)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      integer, intent(in) :: body(:)             !! (n_node) rigid body of each; 0: none

      may_roll = pair%formulation == formulation_nts .and. pair%may_choose .and. .not. &
         (pair_has_order(pair) .or. pair%is_asked .or. pair%slave == pair%master &
         .or. pair%adjust%distance >= 0.0_wp .or. pair%adjust%set > 0)
      if (may_roll) may_roll = is_rigid(scene, scene%surface(pair%slave), body) .and. &
         is_rigid(scene, scene%surface(pair%master), body)
   end function may_roll

   !> Has one rigid body all nodes of a surface?
   pure logical function is_rigid(scene, surface, body)
      type(scene_t), intent(in) :: scene
      type(surface_t), intent(in) :: surface
      integer, intent(in) :: body(:)
      integer, allocatable :: edge(:, :)

      call surface_facets(scene, surface, edge)
      is_rigid = size(edge) > 0
      if (is_rigid) is_rigid = all(edge > 0)
      if (is_rigid) is_rigid = all(body(reshape(edge, [size(edge)])) == body(edge(1, 1))) &
         .and. body(edge(1, 1)) > 0
   end function is_rigid

   !> Pair `i` with the centre of its slave surface, if that is a circle and has a node there.
   subroutine take_disc(scene, i, body, notes, is_disc)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i                   !! index of the pair
      integer, intent(in) :: body(:)             !! (n_node) rigid body of each; 0: none
      type(notes_t), intent(inout) :: notes
      logical, intent(out) :: is_disc
      type(circles_t) :: circles
      type(chain_t) :: chain
      type(error_t), allocatable :: error
      character(len=:), allocatable :: about
      real(wp) :: place(2), radius
      integer :: centre, k

      is_disc = .false.
      call chain_init(chain, scene, scene%surface(scene%pair(i)%slave), error)
      if (allocated(error)) return               ! and is told where contact is set up
      call circles_find(circles, chain, scene%x, body)
      call circle_whole(circles, chain, scene%x, is_disc, place, radius)
      if (.not. is_disc) return
      associate (node => scene%rigid(body(chain%facet(1, 1)))%node)
         centre = node(minloc([(norm2(scene%x(:, node(k)) - place), k = 1, size(node))], 1))
      end associate
      is_disc = norm2(scene%x(:, centre) - place) <= rounding*radius
      call about_text(scene, is_disc, centre, place, about)
      call note_add(notes, where_text(scene, scene%pair(i)%origin) // ": surface " &
         // scene%surface(scene%pair(i)%slave)%name // " is a rigid circle of radius " &
         // to_text(radius) // " about " // about)
      if (is_disc) call hold_centre(scene, i, centre, radius)
   end subroutine take_disc

   !> Where the centre of a circle is, and what follows.
   pure subroutine about_text(scene, has_node, node, place, text)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: has_node
      integer, intent(in) :: node
      real(wp), intent(in) :: place(2)
      character(len=:), allocatable, intent(out) :: text

      if (has_node) then
         text = "node " // to_text(scene%node%label(node)) // ", and is treated as a disc, " &
            // "which rolls; SIDES=BOTH constrains its corners instead"
      else
         text = "(" // to_text(place(1)) // ", " // to_text(place(2)) // "), where its body has " &
            // "no node: it touches with its corners, and each that lands is an impact; with the " &
            // "REF NODE at this place it rolls"
      end if
   end subroutine about_text

   !> Pair `i` as one of a node and its pad, without the other half.
   pure subroutine hold_centre(scene, i, centre, radius)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: i                   !! index of the pair
      integer, intent(in) :: centre              !! node
      real(wp), intent(in) :: radius             !! [L]
      type(surface_t) :: disc

      disc%name = scene%surface(scene%pair(i)%slave)%name
      disc%origin = scene%surface(scene%pair(i)%slave)%origin
      disc%is_nodal = .true.
      allocate(disc%element(0), disc%face(0))
      disc%node = [centre]
      scene%surface = [scene%surface, disc]
      scene%pair(i) = pair_of_one(scene%pair(i))
      associate (pair => scene%pair(i))
         pair%slave = size(scene%surface)
         pair%interaction%offset = pair%interaction%offset + radius
      end associate
   end subroutine hold_centre

end module emcon_discs_plane
