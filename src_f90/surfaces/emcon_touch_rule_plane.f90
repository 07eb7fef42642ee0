!> Which edges of a surface in contact with itself a constraint of one of its nodes looks at.
!>
!> With one side, the first along the surface of two that meet is the slave, and each node has one
!> constraint. With both sides every node is held, also on bodies that the surface runs over; as it
!> may touch several of them at once, it has a constraint for each class of bodies. Pieces that are
!> tied to each other are one body: they meet in the tie, and contact there would bear nothing.
!> Source: docs/theory.md, section 4.
module emcon_touch_rule_plane
   use emcon_bodies, only : bodies_find_tied
   use emcon_chain_plane, only : chain_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_self_contact_plane, only : self_contact_is_meant, self_contact_may_touch
   use emcon_tied_edges, only : tied_ends_find
   implicit none
   private
   public :: touch_rule_t, touch_rule_init, touch_rule_sees, touch_rule_may, touch_rule_allows

   !> Classes of bodies at most, and with them constraints of a node.
   integer, parameter :: most_classes = 4

   type :: touch_rule_t
      integer :: n_class = 1
      integer, allocatable :: body(:)            !! (n_edge) only where each body holds the other
      integer, allocatable :: host(:)            !! (n_node) edge that a tied end stands on; 0: none
      logical, allocatable :: is_buried(:)       !! (n_node) under a tied piece
   end type touch_rule_t

contains

   !> The rule for a chain, whose bodies fall into classes in turn.
   pure subroutine touch_rule_init(self, chain, scene, both_sides)
      type(touch_rule_t), intent(out) :: self
      type(chain_t), intent(in) :: chain
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: both_sides          !! each body holds the other
      integer, allocatable :: body(:), host(:)
      logical, allocatable :: is_buried(:)
      integer :: n_body

      call tied_ends_find(scene, chain%facet, host, is_buried)
      self%host = host(chain%node)
      self%is_buried = is_buried(chain%node)
      if (.not. both_sides) return
      call bodies_find_tied(scene, chain%facet, body, n_body)
      self%body = body(chain%facet(1, :))
      self%n_class = max(1, min(n_body, most_classes))
   end subroutine touch_rule_init

   !> Does a constraint of class `class` look at edge `e`?
   pure logical function touch_rule_sees(self, class, e) result(sees)
      type(touch_rule_t), intent(in) :: self
      integer, intent(in) :: class               !! 1 to n_class
      integer, intent(in) :: e                   !! edge of the chain

      sees = .true.
      if (self%n_class > 1) sees = 1 + mod(self%body(e) - 1, self%n_class) == class
   end function touch_rule_sees

   !> May node `k` of the chain ever touch edge `e`? What a tie ends on an edge does not touch it,
   !> and what is under a tied piece nothing; of the own body never the edges that meet at the node
   !> and those beside them, nor another closed boundary: the body lies between them.
   pure logical function touch_rule_may(self, chain, k, e) result(may)
      type(touch_rule_t), intent(in) :: self
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: e                   !! edge of `chain`
      integer :: own

      may = .not. self%is_buried(k) .and. self%host(k) /= e
      if (.not. may) return
      if (allocated(self%body)) then
         own = maxval(chain%node_edge(:, k))
         if (self%body(own) /= self%body(e)) return
         associate (p => chain%part(own), q => chain%part(e))
            may = .not. (p /= q .and. chain%is_closed(p) .and. chain%is_closed(q))
         end associate
      end if
      if (may) may = self_contact_is_meant(chain, k, e, allocated(self%body))
   end function touch_rule_may

   !> And at x + u? On another body any edge that is the nearest one.
   pure logical function touch_rule_allows(self, chain, k, e, x, u) result(allows)
      type(touch_rule_t), intent(in) :: self
      type(chain_t), intent(in) :: chain
      integer, intent(in) :: k                   !! index into the nodes of `chain`
      integer, intent(in) :: e                   !! edge of `chain`
      real(wp), intent(in) :: x(:, :), u(:, :)   !! (2, n_node of the scene)

      allows = touch_rule_may(self, chain, k, e)
      if (.not. allows) return
      if (allocated(self%body)) then
         if (self%body(maxval(chain%node_edge(:, k))) /= self%body(e)) return
      end if
      allows = self_contact_may_touch(chain, k, e, x, u)
   end function touch_rule_allows

end module emcon_touch_rule_plane
