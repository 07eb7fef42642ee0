!> Bodies in contact that are in each other before the first step with no node behind a surface, as
!> edges that cross or bodies whose faces lie in the same planes: what nodes penetrate is told
!> before, with the gaps. And bodies that are in each other as a later step takes their pair in.
module emcon_start_overlap
   use emcon_contact, only : gap_state_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_evaluation, only : evaluation_at_end
   use emcon_gaps, only : pair_measure, pair_search
   use emcon_guards, only : touching_bar
   use emcon_interactions, only : formulation_nts, formulation_user
   use emcon_kinds, only : wp
   use emcon_motion, only : at_rest, motion_of
   use emcon_march_types, only : march_t
   use emcon_overlap_check, only : overlap_check_step, overlap_t
   use emcon_overlap_query, only : overlap_text
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_steps, only : step_is_dynamic
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : note_add, to_text
   implicit none
   private
   public :: start_overlap_check

   !> Mean gaps that begin below 0 by so much of an edge, with no node behind, are told.
   real(wp), parameter :: least_lift = 1.0e-3_wp

contains

   !> Look at bodies as pairs begin to act that do not resolve an overlap: one is refused, and mean
   !> gaps below 0 are told where a static step moves the bodies apart by them.
   subroutine start_overlap_check(march, scene, begins, error)
      type(march_t), intent(inout) :: march      !! at the start of a step
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: begins(:)           !! (n_pair) those that begin to act
      type(error_t), allocatable, intent(out) :: error   !! bodies overlap

      call refuse_overlap(march, scene, error)
      if (allocated(error)) return
      if (.not. step_is_dynamic(scene%step(march%state%clock%i_step))) call tell_means(march, &
         scene, begins)
   end subroutine start_overlap_check

   !> Is a body by more in another than its contacts let it, so that the run could not become good?
   subroutine refuse_overlap(march, scene, error)
      type(march_t), intent(inout) :: march
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(overlap_t) :: overlap
      character(len=:), allocatable :: cure, text, title, when
      real(wp) :: bar
      integer :: k

      if (size(scene%pair) == 0) return
      bar = touching_bar
      do k = 1, size(march%system%contact)
         bar = max(bar, march%system%contact(k)%contact%lets_in())
      end do
      associate (state => march%state)
         call overlap_check_step(march%overlap_check, scene%x, state%u_start, at_rest(state%u), &
            overlap)
      end associate
      if (.not. overlap%depth > bar) return
      k = pair_of(scene, march%system%space%body, overlap)
      if (k == 0) return
      call overlap_text(overlap, scene%node%label, march%system%space%body, text)
      associate (i_step => march%state%clock%i_step)
         when = "at the start"
         if (i_step > 1) when = "as step " // to_text(i_step) // " takes their pair in,"
      end associate
      if (overlap%is_beside) text = text // "; edges may cross, or faces lie in one plane, " // &
         "without a node inside the other body"
      associate (pair => scene%pair(k))
         cure = "; move the bodies apart"
         if (march%state%clock%i_step > 1) cure = cure // " before, or let a *STATIC step " // &
            "with *CONTACT INTERFERENCE, SHRINK take it in"
         if (allocated(scene%surface(pair%master)%wall)) cure = cure // ", or turn the wall " // &
            "round, so that its normal points to the other side"
         title = "surface " // scene%surface(pair%slave)%name
         if (pair%slave /= pair%master) title = title // " and of surface " // &
            scene%surface(pair%master)%name
         call raise(error, err_input, where_text(scene, pair%origin) // ": error: bodies of " // &
            title // " overlap " // when // " by " // to_text(overlap%depth, 3) // " of an edge: " &
            // text // cure)
      end associate
   end subroutine refuse_overlap

   !> Mean gaps over curved faces may begin below 0 with no node behind a surface; a static step
   !> moves the bodies apart by that. Source: docs/theory.md, section 4.4.
   subroutine tell_means(march, scene, begins)
      type(march_t), intent(inout) :: march
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: begins(:)           !! (n_pair)
      real(wp) :: depth, length
      integer :: i

      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i), contact => march%system%contact(i)%contact)
            if (pair%formulation == formulation_nts .or. pair%formulation == formulation_user &
               .or. pair%slack > 0.0_wp .or. .not. begins(i)) cycle
            call pair_search(march%system, i, motion_of(evaluation_at_end, scene%x, march%state%u, &
               at_rest(march%state%u)))
            call pair_measure(march%system, i, scene%x, march%state%u, at_rest(march%state%u))
            call deepest_of(contact%state, depth, length)
            if (.not. depth > least_lift*length) cycle
            call note_add(march%warnings, "the mean gaps of surface " // &
               scene%surface(pair%slave)%name // " begin below 0 by up to " // to_text(depth, 3) &
               // ", " // to_text(depth/length, 2) // " of an edge, with no node behind surface " &
               // scene%surface(pair%master)%name // ": faces that curve away touch in the mean " &
               // "before their nodes do, and the first increment moves the surfaces apart by " // &
               "that. Displacements of this size need a finer slave surface, or TYPE=NODE TO " // &
               "SURFACE")
         end associate
      end do
   end subroutine tell_means

   !> How far the gap that is closed farthest by its size is, and that size; 0 and 1: none is.
   pure subroutine deepest_of(state, depth, length)
      type(gap_state_t), intent(in) :: state(:)
      real(wp), intent(out) :: depth, length     !! [L]
      integer :: i

      depth = 0.0_wp
      length = 1.0_wp
      do i = 1, size(state)
         if (.not. (state(i)%is_near .and. state(i)%is_over)) cycle
         if (.not. -state(i)%gap0*length > depth*state(i)%size) cycle
         depth = -state(i)%gap0
         length = state(i)%size
      end do
   end subroutine deepest_of

   !> The pair whose surfaces have what the overlap names; 0: none does. Behind a wall any node of
   !> the slave's body may be.
   pure integer function pair_of(scene, body, overlap) result(pair)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: body(:)             !! (n_node) of nodes, from 1; 0: of none
      type(overlap_t), intent(in) :: overlap
      integer, allocatable :: slave(:), master(:)
      logical :: is_here, is_there

      do pair = 1, size(scene%pair)
         call surface_nodes(scene, scene%surface(scene%pair(pair)%slave), slave)
         call surface_nodes(scene, scene%surface(scene%pair(pair)%master), master)
         if (allocated(scene%surface(scene%pair(pair)%master)%wall)) then
            is_here = any(overlap%facet(1) == scene%surface(scene%pair(pair)%master)%wall%node) &
               .and. any(body(slave) == body(overlap%node))
         else
            is_here = find_sorted(slave, overlap%node) > 0 .and. &
               find_sorted(master, overlap%facet(1)) > 0
         end if
         is_there = find_sorted(master, overlap%node) > 0 .and. &
            find_sorted(slave, overlap%facet(1)) > 0
         if (is_here .or. is_there) return
      end do
      pair = 0
   end function pair_of

end module emcon_start_overlap
