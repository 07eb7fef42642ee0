!> Contact surfaces without mass: which nodes give theirs away, and to which.
!>
!> Without mass at one side of each contact the motion in contact is that of the massive freedoms in
!> a potential, whose force is continuous in time. An element that stands on massless nodes puts its
!> mass on its other nodes: the consistent mass between these, scaled to the mass of the element, so
!> that the total is exact, and frequencies change by the square of the element size. Source:
!> docs/theory.md, section 6.4.
module emcon_massless
   use emcon_bodies, only : bodies_find
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_massless_surfaces, only : nodes_that_keep_mass, pair_keeps_mass
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_steps, only : initiation_massless, initiation_persistent, step_initiation
   use emcon_surface_nodes, only : surface_nodes
   implicit none
   private
   public :: massless_bare, massless_find, massless_shed, massless_return, massless_follow, &
      massless_share

   !> Those around a node that have kept their mass.
   type :: stencil_t
      real(wp) :: mass = 0.0_wp                  !! of the node: its share of its elements [M]
      integer, allocatable :: node(:)            !! around it
      real(wp), allocatable :: weight(:)         !! > 0, their sum is 1
   end type stencil_t

contains

   !> The nodes that have no mass of their own: those of elements without inertia alone, less those
   !> that are given mass or forces or stand in ties, equations and rigid bodies, whose masses they
   !> may bear.
   pure subroutine massless_bare(scene, solid, is_given, without_density)
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: is_given(:)         !! (n_node) mass or forces
      logical, intent(out) :: without_density(:) !! (n_node)
      integer :: e

      without_density = .false.
      if (all(solid%trait%has_inertia)) return
      do e = 1, solid%n_element
         if (.not. solid%trait%has_inertia(e)) without_density(solid%node(:solid%trait%n_node( &
            e), e)) = .true.
      end do
      do e = 1, solid%n_element
         if (solid%trait%has_inertia(e)) without_density(solid%node(:solid%trait%n_node(e), e)) &
            = .false.
      end do
      call leave_joined(scene, is_given, without_density)
   end subroutine massless_bare

   !> Nodes of ties, equations and rigid bodies, and those that are given something, are not meant.
   pure subroutine leave_joined(scene, is_given, is_meant)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_given(:)         !! (n_node) mass or forces
      logical, intent(inout) :: is_meant(:)      !! (n_node)
      integer :: i

      do i = 1, size(scene%tie)
         is_meant(scene%tie(i)%rows%node) = .false.
      end do
      do i = 1, size(scene%equation)
         is_meant(scene%equation(i)%node) = .false.
      end do
      do i = 1, size(scene%rigid)
         is_meant(scene%rigid(i)%node) = .false.
      end do
      is_meant = is_meant .and. .not. is_given
   end subroutine leave_joined

   !> The slave nodes of all pairs but persistent ones, if dynamic steps ask; less those of surfaces
   !> that are damped or rebound, those that are driven in such a step, of rigid bodies, in ties and
   !> equations, or given mass or forces, and those of elements that would keep none, and those that
   !> others would not hold. And all nodes that have none anyway.
   pure subroutine massless_find(scene, solid, is_given, without_density, is_massless)
      type(scene_t), intent(in) :: scene
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: is_given(:)         !! (n_node) mass or forces
      logical, intent(in) :: without_density(:)  !! (n_node) those of `massless_bare`
      logical, intent(out) :: is_massless(:)     !! (n_node)
      integer :: i

      is_massless = .false.
      if (.not. any(step_initiation(scene%step) == initiation_massless)) return
      do i = 1, size(scene%pair)
         if (scene%pair(i)%initiation == initiation_persistent) cycle
         call mark_surface(scene, scene%pair(i)%slave, .true., is_massless)
      end do
      do i = 1, size(scene%pair)
         if (.not. pair_keeps_mass(scene%pair(i))) cycle
         call mark_surface(scene, scene%pair(i)%slave, .false., is_massless)
         call mark_surface(scene, scene%pair(i)%master, .false., is_massless)
      end do
      is_massless = is_massless .and. .not. nodes_that_keep_mass(scene)
      call leave_joined(scene, is_given, is_massless)
      call keep_one(solid, is_massless)
      call keep_swinging(solid, size(scene%x, 1), is_massless)
      is_massless = is_massless .or. without_density
   end subroutine massless_find

   !> Say of the nodes of surface `k`, if there is one, that they have no mass, or that they do.
   pure subroutine mark_surface(scene, k, mark, is_massless)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      logical, intent(in) :: mark
      logical, intent(inout) :: is_massless(:)   !! (n_node)
      integer, allocatable :: node(:)

      if (k == 0) return
      call surface_nodes(scene, scene%surface(k), node)
      is_massless(node) = mark
   end subroutine mark_surface

   !> Leave the nodes of each element that would keep no mass theirs.
   pure subroutine keep_one(solid, is_massless)
      type(solid_t), intent(in) :: solid
      logical, intent(inout) :: is_massless(:)
      logical :: keeps(size(is_massless))
      integer :: e

      keeps = .false.
      do e = 1, solid%n_element
         associate (node => solid%node(:solid%trait%n_node(e), e))
            if (solid%trait%has_inertia(e) .and. all(is_massless(node))) keeps(node) = .true.
         end associate
      end do
      is_massless = is_massless .and. .not. keeps
   end subroutine keep_one

   !> Leave the nodes theirs that hang together on fewer others than a place has coordinates: with
   !> those held they would swing about them freely, which no balance tells.
   pure subroutine keep_swinging(solid, n_dim, is_massless)
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! coordinates of a node
      logical, intent(inout) :: is_massless(:)
      integer, allocatable :: part(:)            !! (n_node) number of what hangs together
      integer, allocatable :: holder(:, :)       !! (n_dim, n_part) nodes that hold it; 0: no more
      integer :: hanging(size(solid%node, 1), size(solid%node, 2)), n_part, e, i, k

      hanging = solid%node
      do e = 1, solid%n_element
         associate (n => solid%trait%n_node(e))
            hanging(n + 1:, e) = 0
            where (.not. is_massless(solid%node(:n, e))) hanging(:n, e) = 0
         end associate
      end do
      call bodies_find(hanging, size(is_massless), part, n_part)
      allocate(holder(n_dim, n_part), source=0)
      do e = 1, solid%n_element
         k = maxval(hanging(:, e))
         if (k == 0) cycle
         associate (own => holder(:, part(k)), node => solid%node(:solid%trait%n_node(e), e))
            do i = 1, size(node)
               if (hanging(i, e) > 0 .or. any(own == node(i))) cycle
               if (any(own == 0)) own(findloc(own, 0, 1)) = node(i)
            end do
         end associate
      end do
      do i = 1, size(is_massless)
         if (part(i) > 0) is_massless(i) = all(holder(:, part(i)) > 0)
      end do
   end subroutine keep_swinging

   !> Move the mass of elements from their massless nodes to their others.
   pure subroutine massless_shed(solid, is_massless)
      type(solid_t), intent(inout) :: solid
      logical, intent(in) :: is_massless(:)      !! (n_node)
      integer :: e, i

      do e = 1, solid%n_element
         if (.not. solid%trait%has_inertia(e)) cycle
         associate (n => solid%trait%n_node(e))
            call shed(is_massless(solid%node(:n, e)), solid%mass%consistent(:n, :n, e))
            do i = 1, n
               solid%mass%of_volume(i, e) = sum(solid%mass%consistent(:n, i, e))
            end do
         end associate
      end do
   end subroutine massless_shed

   !> The same in one element.
   pure subroutine shed(is_massless, mass)
      logical, intent(in) :: is_massless(:)
      real(wp), intent(inout) :: mass(:, :)      !! [M]
      real(wp) :: total
      integer :: i

      if (.not. any(is_massless)) return
      total = sum(mass)
      do i = 1, size(is_massless)
         if (.not. is_massless(i)) cycle
         mass(i, :) = 0.0_wp
         mass(:, i) = 0.0_wp
      end do
      mass = mass*(total/sum(mass))
   end subroutine shed

   !> The largest part of its mass that a body has moved off massless nodes, and which body: of each
   !> element as many parts as such nodes.
   pure subroutine massless_share(solid, is_massless, body, share, largest)
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: is_massless(:)      !! (n_node)
      integer, intent(in) :: body(:)             !! (n_node) number of its body; 0: of none
      real(wp), intent(out) :: share             !! 0 to 1
      integer, intent(out) :: largest            !! number of the body; 0: no mass is moved
      real(wp), dimension(maxval(body)) :: moved, total
      integer :: e

      moved = 0.0_wp
      total = 0.0_wp
      do e = 1, solid%n_element
         associate (node => solid%node(:solid%trait%n_node(e), e), n => solid%trait%n_node(e))
            associate (mass => sum(solid%mass%consistent(:n, :n, e)), k => body(node(1)))
               total(k) = total(k) + mass
               moved(k) = moved(k) + mass*count(is_massless(node))/n
            end associate
         end associate
      end do
      share = 0.0_wp
      largest = 0
      do e = 1, size(total)
         if (.not. moved(e) > share*total(e)) cycle
         share = moved(e)/total(e)
         largest = e
      end do
   end subroutine massless_share

   !> Mass that comes back to nodes: that of their motion relative to what has kept its mass around
   !> them, m d d^T with d = 1 at the node and its weights of `massless_follow` taken from it. Total
   !> mass and centre stay, and so do momenta and energy of a node that moves with the others.
   subroutine massless_return(solid, may_be_massless, has_mass, relative, error)
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: may_be_massless(:)  !! (n_node) massless at first
      logical, intent(in) :: has_mass(:)         !! (n_node) those of them that get mass
      type(csr_t), intent(out) :: relative       !! (n_node x n_node) [M]
      type(error_t), allocatable, intent(out) :: error
      type(stencil_t) :: stencil(count(has_mass))
      integer, allocatable :: slot(:), start(:), list(:)
      integer :: i, j, k, s

      k = 0
      allocate(start(size(stencil) + 1), source=1)
      allocate(list(0))
      do i = 1, size(has_mass)
         if (.not. has_mass(i)) cycle
         k = k + 1
         call find_stencil(solid, may_be_massless, i, stencil(k))
         list = [list, i, stencil(k)%node]
         start(k + 1) = size(list) + 1
      end do
      call csr_from_elements(relative, solid%n_node, start, list, slot, error)
      if (allocated(error)) return
      s = 0
      do k = 1, size(stencil)
         associate (d => [1.0_wp, -stencil(k)%weight])
            do j = 1, size(d)
               do i = 1, size(d)
                  s = s + 1
                  associate (to => relative%value(slot(s)))
                     to = to + real(stencil(k)%mass*d(i)*d(j), dp)
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine massless_return

   !> Let the nodes `has_mass` move with what has kept its mass around them.
   subroutine massless_follow(solid, may_be_massless, has_mass, v)
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: may_be_massless(:)  !! (n_node) massless at first
      logical, intent(in) :: has_mass(:)         !! (n_node) those of them that get mass
      real(wp), intent(inout) :: v(:, :)         !! (n_dim, n_node) [L/T]
      type(stencil_t) :: stencil
      integer :: i

      do i = 1, size(has_mass)
         if (.not. has_mass(i)) cycle
         call find_stencil(solid, may_be_massless, i, stencil)
         v(:, i) = matmul(v(:, stencil%node), stencil%weight)
      end do
   end subroutine massless_follow

   !> What has kept its mass around `node`: the mean in each of its elements, and of the elements by
   !> their mass.
   pure subroutine find_stencil(solid, may_be_massless, node, stencil)
      type(solid_t), intent(in) :: solid
      logical, intent(in) :: may_be_massless(:)
      integer, intent(in) :: node
      type(stencil_t), intent(out) :: stencil
      real(wp) :: weight(size(may_be_massless)), share
      integer :: e

      weight = 0.0_wp
      do e = 1, solid%n_element
         associate (own => solid%node(:solid%trait%n_node(e), e))
            if (.not. any(own == node)) cycle
            share = sum(solid%mass%consistent(:size(own), :size(own), e))/size(own)
            stencil%mass = stencil%mass + share
            associate (kept => pack(own, .not. may_be_massless(own)))
               weight(kept) = weight(kept) + share/size(kept)
            end associate
         end associate
      end do
      stencil%node = pack([(e, e = 1, size(weight))], weight > 0.0_wp)
      stencil%weight = weight(stencil%node)/stencil%mass
   end subroutine find_stencil

end module emcon_massless
