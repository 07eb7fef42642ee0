!> Do contact forces pull at single nodes? The weights of dual multipliers change their sign within
!> an edge, so that nodes that look at its far part are pulled while the edge is pushed.
!>
!> Source: docs/theory.md, eq. (15k).
module emcon_nodal_pull
   use emcon_constraints, only : constraint_set_t
   use emcon_kinds, only : wp
   use emcon_text, only : to_text
   implicit none
   private
   public :: nodal_pull_t, nodal_pull_add, nodal_pull_join, nodal_pull_share, nodal_pull_text

   !> Pulls above this part of the largest force on a node are told.
   real(wp), parameter :: told_share = 0.05_wp

   type :: nodal_pull_t
      real(wp) :: pull = 0.0_wp                  !! the largest on a node [M L/T^2]
      real(wp) :: force = 0.0_wp                 !! the largest force on one [M L/T^2]
   end type nodal_pull_t

contains

   !> Add the forces of the integrated gaps of `set`: those on a node against where the conditions
   !> push its side.
   pure subroutine nodal_pull_add(self, set, n_node)
      type(nodal_pull_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: n_node              !! of the scene

      if (set%n == set%n_permanent) return
      if (any(set%item(set%n_permanent + 1:set%n)%is_mean)) call add_all(self, set, n_node, &
         size(set%item(set%n_permanent + 1)%g, 1))
   end subroutine nodal_pull_add

   pure subroutine add_all(self, set, n_node, n_dim)
      type(nodal_pull_t), intent(inout) :: self
      type(constraint_set_t), intent(in) :: set
      integer, intent(in) :: n_node, n_dim
      real(wp), dimension(n_dim, n_node) :: force, push
      real(wp) :: along(n_dim)
      integer :: k, i

      force = 0.0_wp
      push = 0.0_wp
      do k = set%n_permanent + 1, set%n
         associate (item => set%item(k), lam => set%lam(k))
            if (.not. item%is_mean) cycle
            along = sum(item%g(:, item%n_slave + 1:item%n_node), dim=2)
            if (.not. length(along) > 0.0_wp) cycle
            along = along/length(along)
            do i = 1, item%n_node
               if (i == item%n_slave + 1) along = -along
               associate (node => item%node(i))
                  force(:, node) = force(:, node) + lam*item%g(:, i)
                  push(:, node) = push(:, node) - abs(lam)*length(item%g(:, i))*along
               end associate
            end do
         end associate
      end do
      do i = 1, n_node
         if (.not. length(push(:, i)) > 0.0_wp) cycle
         self%pull = max(self%pull, -dot_product(force(:, i), push(:, i))/length(push(:, i)))
         self%force = max(self%force, length(force(:, i)))
      end do
   end subroutine add_all

   pure real(wp) function length(a)
      real(wp), intent(in) :: a(:)               !! (n_dim)

      length = sqrt(dot_product(a, a))
   end function length

   !> Take the larger figures of both.
   pure subroutine nodal_pull_join(self, other)
      type(nodal_pull_t), intent(inout) :: self
      type(nodal_pull_t), intent(in) :: other

      self%pull = max(self%pull, other%pull)
      self%force = max(self%force, other%force)
   end subroutine nodal_pull_join

   !> The largest pull by the largest force.
   pure real(wp) function nodal_pull_share(self)
      type(nodal_pull_t), intent(in) :: self

      nodal_pull_share = 0.0_wp
      if (self%force > 0.0_wp) nodal_pull_share = self%pull/self%force
   end function nodal_pull_share

   !> What is to be told of it, empty if nothing is.
   pure subroutine nodal_pull_text(self, text)
      type(nodal_pull_t), intent(in) :: self
      character(len=:), allocatable, intent(out) :: text   !! a sentence

      text = ""
      if (nodal_pull_share(self) > told_share) text = "contact forces pull at single nodes, by " &
         // "up to " // to_text(100.0_wp*nodal_pull_share(self), 2) // " % of the largest force " &
         // "on a node: weights of MULTIPLIER=DUAL change their sign within an edge. Pressures " &
         // "and sums over an edge push; with MULTIPLIER=STANDARD of *MORTAR all nodes are pushed"
   end subroutine nodal_pull_text

end module emcon_nodal_pull
