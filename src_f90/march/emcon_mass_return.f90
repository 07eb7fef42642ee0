!> Mass that comes back to contact nodes which find no balance without it.
!>
!> Where a massless node has no stable balance, a soft one on a sharp corner, nothing slows its
!> motion and no step is short enough. Such a node takes its mass back, with all massless nodes of
!> its elements, before the step is tried again; its contact is persistent from then on. What comes
!> back is inertia relative to what has mass around the node, so that momenta and kinetic energy
!> stay where it moves with that. Source: docs/theory.md, section 6.4.
module emcon_mass_return
   use emcon_active_set, only : active_set_mark
   use emcon_errors, only : error_t
   use emcon_kinds, only : wp
   use emcon_layer, only : layer_renew
   use emcon_march_types, only : march_t
   use emcon_massless, only : massless_follow
   use emcon_scene, only : scene_t
   use emcon_term_registry, only : terms_return_mass, terms_solid
   implicit none
   private
   public :: mass_match, mass_return, mass_find_troubled, mass_is_at, mass_may_return

contains

   !> Let the model have the masses that the state says. The step of the deck has to begin anew
   !> where they change.
   subroutine mass_match(self, scene, has_changed, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(out) :: has_changed        !! these are others
      type(error_t), allocatable, intent(out) :: error

      has_changed = any((self%massless%may_be .and. .not. self%state%contacts%has_mass) &
         .neqv. self%layer%is_massless)
      if (.not. has_changed) return
      call terms_return_mass(self%system%term, self%massless%may_be, self%state%contacts%has_mass, &
         error)
      if (.not. allocated(error)) call layer_renew(self%layer, scene, &
         self%massless%may_be .and. .not. self%state%contacts%has_mass, self%system, error)
   end subroutine mass_match

   !> The massless nodes that keep a step from being solved, and those of their elements: where the
   !> balance of the layer fails, those of the contacts that open or close; else the one that the
   !> largest force is left on, or all in contact.
   subroutine mass_find_troubled(self, scene, has_residual, needs_mass)
      type(march_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: has_residual        !! of an iterate that is no solution
      logical, intent(out) :: needs_mass(:)      !! (n_node)
      real(wp) :: left(size(needs_mass))
      logical :: may_have_mass(size(needs_mass))
      integer :: i

      may_have_mass = mass_may_return(self)
      needs_mass = self%layer%needs_mass
      if (.not. any(needs_mass)) then
         left = 0.0_wp
         if (has_residual) left = maxval(abs(merge(self%newton%left, 0.0_wp, &
            self%system%space%numbering%unknown > 0)), 1)
         where (.not. self%layer%is_massless) left = 0.0_wp
         if (maxval(left) > 0.0_wp .and. maxval(left) <= huge(left)) then
            needs_mass(maxloc(left, 1)) = .true.
         else
            call active_set_mark(self%active, self%system, self%state%contacts, needs_mass)
            if (.not. any(needs_mass .and. self%layer%is_massless)) needs_mass = .true.
         end if
      end if
      call mark_elements(scene, self%layer%is_massless .and. needs_mass, needs_mass)
      do i = 1, size(needs_mass)
         needs_mass(i) = needs_mass(i) .and. may_have_mass(i)
      end do
      if (.not. any(needs_mass)) needs_mass = may_have_mass
   end subroutine mass_find_troubled

   !> Do nodes have mass now?
   pure function mass_is_at(self, node) result(is_there)
      type(march_t), intent(in) :: self
      integer, intent(in) :: node(:)             !! (any)
      logical :: is_there(size(node))

      is_there = .not. self%massless%without_density(node)
      if (self%layer%is_on) is_there = is_there .and. .not. self%layer%is_massless(node)
   end function mass_is_at

   !> Nodes without mass that could take it back.
   pure function mass_may_return(self) result(may_return)
      type(march_t), intent(in) :: self
      logical :: may_return(size(self%layer%is_massless))

      may_return = self%layer%is_massless .and. .not. self%massless%without_density
   end function mass_may_return

   !> The nodes of all elements on nodes `of`.
   pure subroutine mark_elements(scene, of, is_marked)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: of(:)               !! (n_node)
      logical, intent(inout) :: is_marked(:)     !! (n_node)
      integer :: e

      do e = 1, size(scene%element%kind)
         associate (node => pack(scene%element%node(:, e), scene%element%node(:, e) > 0))
            if (any(of(node))) is_marked(node) = .true.
         end associate
      end do
   end subroutine mark_elements

   !> Give the nodes `is_back` their mass back: they move with what has mass around them. The step
   !> of the deck has to begin anew.
   subroutine mass_return(self, scene, is_back, error)
      type(march_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_back(:)          !! (n_node) massless so far
      type(error_t), allocatable, intent(out) :: error
      logical :: has_changed

      call massless_follow(terms_solid(self%system%term), self%massless%may_be, is_back, &
         self%state%v)
      self%state%contacts%has_mass = self%state%contacts%has_mass .or. is_back
      call mass_match(self, scene, has_changed, error)
   end subroutine mass_return

end module emcon_mass_return
