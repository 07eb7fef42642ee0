!> Overclosure that a step resolves: that of the curves that were meshed, not of their chords.
!>
!> Where edges of two meshes do not match, gaps between chords differ from those between the curves
!> by up to the sagitta of an edge, often more than an interference. Source: docs/theory.md,
!> section 6.6.
module emcon_overclosure
   use emcon_contact, only : contact_t
   use emcon_interactions, only : contact_options_t
   use emcon_kinds, only : wp
   implicit none
   private
   public :: overclosure_follow_arcs

   !> What changes an overclosure by less than this part of it is left out: surfaces whose nodes
   !> meet nodes, and flat ones, are measured as they are.
   real(wp), parameter :: small_part = 0.01_wp

contains

   !> Let a contact measure its gaps between arcs from now on, if that matters for what is closed at
   !> x + u, by either measure.
   subroutine overclosure_follow_arcs(contact, x, u, options, largest, deepest)
      class(contact_t), intent(inout) :: contact !! configured
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (n_dim, n_node) as all begins [L]
      type(contact_options_t), intent(in) :: options         !! it was configured with
      real(wp), intent(out) :: largest           !! change of a gap that is closed; 0: none [L]
      real(wp), intent(out) :: deepest           !! interference between the arcs, if that is not 0
      real(wp), dimension(contact%n_constraint) :: chords, arcs
      logical :: is_closed(contact%n_constraint)

      call contact%follow_arcs(x, options, .false.)
      call measure(chords)
      call contact%follow_arcs(x, options, .true.)
      call measure(arcs)
      is_closed = min(chords, arcs) < 0.0_wp
      largest = maxval(abs(arcs - chords), mask=is_closed)
      deepest = max(0.0_wp, -minval(arcs))
      if (any(is_closed)) then
         if (largest > -small_part*minval(min(chords, arcs), mask=is_closed)) return
      end if
      largest = 0.0_wp
      call contact%follow_arcs(x, options, .false.)

   contains

      !> The gaps as nothing moves; 0 where there is none.
      subroutine measure(gap)
         real(wp), intent(out) :: gap(:)         !! (n_constraint) [L]
         real(wp) :: rest(size(u, 1), size(u, 2))

         rest = 0.0_wp
         contact%reach = 0.0_wp
         call contact%begin_step(x, u, rest)
         call contact%measure(x, u, rest)
         gap = merge(contact%state%gap0, 0.0_wp, contact%state%is_near .and. contact%state%is_over)
      end subroutine measure

   end subroutine overclosure_follow_arcs

end module emcon_overclosure
