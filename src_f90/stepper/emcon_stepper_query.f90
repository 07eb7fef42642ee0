! build: holder
!> What the engine computes for a step, asked for from outside: residual, tangent, mass, momenta.
!>
!> A query has work space of its own, with its own system and contact search: asking changes neither
!> the model nor what later steps give, to the last bit. One query belongs to one model and follows
!> its changes. Unknowns are those of the present step of the deck, `query_unknowns` numbers them.
module emcon_stepper_query
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_active_set, only : active_set_select, active_set_take
   use emcon_constraint_rows, only : constraints_add_curvature, constraints_merge_pattern, &
      constraints_rows
   use emcon_constraints, only : constraints_evaluate, constraints_force
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : err_analysis, error_t, raise
   use emcon_host_set, only : host_set_t
   use emcon_kinds, only : wp
   use emcon_ledger, only : body_momenta
   use emcon_motion, only : at_rest, motion_evaluate
   use emcon_march, only : march_free, march_init, march_resume, march_t
   use emcon_march_guess, only : follow_links, march_guess
   use emcon_march_past, only : march_past_begin
   use emcon_null_space, only : null_space_free, null_space_t
   use emcon_numbering, only : pick_unknowns
   use emcon_evaluation, only : evaluation_has_inertia, instant_t
   use emcon_stepper, only : stepper_t
   use emcon_stepper_check, only : check_field, check_list, check_size, check_that, &
      stepper_check_open, stepper_check_smooth
   use emcon_gaps, only : gaps_search
   use emcon_system, only : system_check_response, system_renew, system_respond
   use emcon_term_registry, only : terms_mass
   use emcon_text, only : to_text
   use emcon_rotation, only : n_turn
   implicit none
   private
   public :: query_t, query_free, query_sync, query_follow, query_place, query_forget
   public :: query_guess, query_evaluate, query_residual, query_tangent, query_unknowns, &
      query_mass, query_momenta

   type :: query_t
      type(march_t) :: march                     !! its own; the state is that of the model
      logical :: is_evaluated = .false.          !! by `query_evaluate`, for the present model
      real(wp), allocatable :: contact(:, :)     !! (2, n_node) sum of lam_k g_k
      logical :: has_set = .false.               !! the constraints selected last are evaluated
      logical :: has_begun = .false.             !! a step of contact, by `query_begin_contact`
      type(host_set_t) :: host_set               !! of that step
      type(null_space_t), allocatable :: null_space   !! of the last `query_null_space`
      type(csr_t), allocatable :: map            !! freedoms of the nodes by the host's unknowns
      logical :: has_tangent = .false.           !! of the last evaluation
      real(wp) :: frequency = 0.0_wp             !! 1/h of the step of contact; 0: not known [1/T]
      logical :: has_null_space = .false.
      integer, private :: revision = -1          !! of the model that the numbering is that of
   end type query_t

contains

   !> Free what libraries hold for the query, and all work space.
   subroutine query_free(self)
      type(query_t), intent(inout) :: self

      call march_free(self%march)
      if (allocated(self%null_space)) call null_space_free(self%null_space)
      call clear(self)
   end subroutine query_free

   subroutine clear(self)
      type(query_t), intent(out) :: self

      self%is_evaluated = .false.
   end subroutine clear

   !> Take over the present model and state of the stepper.
   subroutine query_sync(self, stepper, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      call stepper_check_open(stepper, error)
      if (allocated(error)) return
      if (self%revision < 0) then
         call march_init(self%march, stepper%scene, error, stepper%host)
         if (allocated(error)) return
         allocate(self%contact, source=at_rest(stepper%scene%x))
         self%revision = 0
      end if
      self%march%state = stepper%march%state
      if (self%revision /= stepper%march%revision) then
         call query_forget(self)
         call march_resume(self%march, stepper%scene, error)
         if (allocated(error)) return
         self%march%state = stepper%march%state
         self%revision = stepper%march%revision
      end if
      call system_renew(self%march%system, stepper%scene)
   end subroutine query_sync

   !> Forget the last evaluation if the unknowns of the model have been numbered anew since.
   pure subroutine query_follow(self, stepper)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper

      if (self%revision /= stepper%march%revision) call query_forget(self)
   end subroutine query_follow

   !> Forget the last evaluation.
   pure subroutine query_forget(self)
      type(query_t), intent(inout) :: self

      self%is_evaluated = .false.
      self%has_set = .false.
      self%has_begun = .false.
      self%has_null_space = .false.
   end subroutine query_forget

   !> Where a step of size `h` from the present state would start its iteration: prescribed freedoms
   !> at their places at the end, free ones moved on by their velocities.
   subroutine query_guess(self, stepper, h, u1, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: h                      !! > 0 [T]
      real(wp), allocatable, intent(out) :: u1(:, :)           !! (2, n_node) [L]
      type(error_t), allocatable, intent(out) :: error

      call query_sync(self, stepper, error)
      call check_duration(h, error)
      if (allocated(error)) return
      call march_guess(self%march, stepper%scene, now(self), h, is_at_rest=.false.)
      u1 = self%march%state%u + self%march%motion%du
   end subroutine query_guess

   subroutine check_duration(h, error)
      real(wp), intent(in) :: h
      type(error_t), allocatable, intent(inout) :: error

      call check_that(ieee_is_finite(h), "a step needs a size h > 0 that is finite", error)
      if (allocated(error)) return
      call check_that(h > 0.0_wp, "a step needs a size h > 0, not " // to_text(h), error)
   end subroutine check_duration

   !> The instant of the present state.
   pure type(instant_t) function now(self)
      type(query_t), intent(in) :: self

      now%step_time = self%march%state%clock%step_time
      now%total_time = self%march%state%clock%start_time + self%march%state%clock%step_time
      now%h_before = self%march%state%history%h_before
   end function now

   !> Evaluate the step of size `h` from the present state to `u1`: what the functions below give
   !> belongs to the last evaluation. Constraints that act are those of the state, or `is_active`,
   !> less those that have no surface near; their multipliers those of the state, or `lam`.
   !> Dependent nodes of ties and equations follow the others.
   subroutine query_evaluate(self, stepper, h, u1, with_tangent, error, lam, is_active)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: h                      !! > 0 [T]
      real(wp), intent(in) :: u1(:, :)               !! (2, n_node) [L]
      logical, intent(in) :: with_tangent
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: lam(:)       !! (n_constraint) [M L/T^2]
      logical, intent(in), optional :: is_active(:)  !! (n_constraint)
      logical :: is_finite

      call query_forget(self)
      call query_sync(self, stepper, error)
      if (.not. allocated(error)) call stepper_check_smooth(stepper, error)
      call check_field("u1", u1, stepper%scene, error)
      call check_duration(h, error)
      call take_contact(self, error, lam, is_active)
      if (.not. allocated(error)) call march_past_begin(self%march, stepper%scene, now(self), error)
      if (allocated(error)) return
      call take_motion(self, stepper, h, u1)
      associate (march => self%march, system => self%march%system)
         call system_respond(system, march%motion, with_tangent)
         call system_check_response(system, "u1", error)
         if (allocated(error)) return
         call begin_contact(self)
         call active_set_select(march%active, system, march%motion)
         call constraints_evaluate(march%active%set, system, march%motion)
         call constraints_rows(march%active%set, system%space%numbering)
         call constraints_force(march%active%set, 1, self%contact)
         is_finite = all(ieee_is_finite(system%response%residual))
         if (with_tangent) is_finite = is_finite .and. all(ieee_is_finite(system%matrix%value))
         if (.not. is_finite) call raise(error, err_analysis, "the step of the size " // &
            to_text(h) // " to u1 has a residual or a tangent that is not finite")
      end associate
      if (allocated(error)) return
      self%is_evaluated = .true.
      self%has_set = .true.
      self%has_tangent = with_tangent
   end subroutine query_evaluate

   !> Take over the given contact in place of that of the state.
   subroutine take_contact(self, error, lam, is_active)
      type(query_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: lam(:)
      logical, intent(in), optional :: is_active(:)

      associate (state => self%march%state)
         if (present(lam)) call check_list("lam", lam, size(state%contacts%lam), error)
         if (present(is_active)) call check_size("the active set", size(is_active), &
            size(state%contacts%lam), error)
         if (allocated(error)) return
         call state%contacts%take(lam, is_active)
      end associate
   end subroutine take_contact

   !> Take over the motion to `u1`. In the inertia prescribed freedoms have the velocities of their
   !> conditions, wherever `u1` puts them.
   subroutine take_motion(self, stepper, h, u1)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: h
      real(wp), intent(in) :: u1(:, :)
      real(wp) :: du
      integer :: k

      associate (march => self%march)
         call march_guess(march, stepper%scene, now(self), h, is_at_rest=.true.)
         associate (list => stepper%scene%step(march%state%clock%i_step)%prescribed)
            do k = 1, size(list)
               associate (a => list(k)%dof, i => list(k)%node)
                  du = u1(a, i) - march%state%u(a, i)
                  if (evaluation_has_inertia(march%motion%evaluation)) march%motion%offset(a, i) = &
                     march%motion%offset(a, i) + (march%motion%du(a, i) - du)
               end associate
            end do
         end associate
         march%motion%du = u1 - march%state%u
         call follow_links(march%system, march%motion%du)
         call follow_links(march%system, march%motion%offset)
         call motion_evaluate(march%motion)
      end associate
   end subroutine take_motion

   !> Take the wanted constraints that have a surface near, by a search for this motion.
   subroutine begin_contact(self)
      type(query_t), intent(inout) :: self
      type(gap_state_t), allocatable :: gap(:)

      associate (system => self%march%system, active => self%march%active, &
            state => self%march%state)
         call gaps_search(system, self%march%motion, gap)
         call active_set_take(active, system, state%contacts, gap%is_near)
      end associate
   end subroutine begin_contact

   !> Take over a motion from `u0` by `du`.
   subroutine query_place(self, stepper, u0, du, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: u0(:, :), du(:, :)           !! (n_dim, n_node) [L]
      type(error_t), allocatable, intent(inout) :: error   !! of an earlier check: nothing is done

      call check_field("u0", u0, stepper%scene, error)
      call check_field("du", du, stepper%scene, error)
      if (allocated(error)) return
      self%march%motion%u0 = u0
      self%march%motion%du = du
      call motion_evaluate(self%march%motion)
   end subroutine query_place

   !> There is an evaluation to report on.
   subroutine check_evaluated(self, error)
      type(query_t), intent(in) :: self
      type(error_t), allocatable, intent(inout) :: error

      call check_that(self%is_evaluated, &
         "no step was evaluated since the model was made or its unknowns changed", error)
   end subroutine check_evaluated

   !> Residual of the step: inertia, internal forces less loads, and `with_contact` less contact
   !> forces. On prescribed freedoms it is the reaction.
   subroutine query_residual(self, with_contact, nodal, unknown, error)
      type(query_t), intent(in) :: self
      logical, intent(in) :: with_contact
      real(wp), allocatable, intent(out) :: nodal(:, :)      !! (2, n_node) [M L/T^2]
      real(wp), allocatable, intent(out) :: unknown(:)       !! (n_unknown) T^T of the nodal one
      type(error_t), allocatable, intent(out) :: error

      call check_evaluated(self, error)
      if (allocated(error)) return
      allocate(nodal, source=self%march%system%response%residual)
      if (with_contact) nodal = nodal - self%contact
      allocate(unknown(self%march%system%space%numbering%n_unknown))
      call pick_unknowns(self%march%system%space%numbering, nodal, unknown)
   end subroutine query_residual

   !> Derivative of the residual on the unknowns by the unknowns at the end of the step, for given
   !> multipliers; `with_contact` with the second derivatives of the gaps. The evaluation has to be
   !> one with tangent.
   subroutine query_tangent(self, with_contact, matrix, error)
      type(query_t), intent(in) :: self
      logical, intent(in) :: with_contact
      type(csr_t), intent(out) :: matrix             !! (n_unknown x n_unknown) [M/T^2]
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: slot(:)
      integer :: k

      call check_evaluated(self, error)
      call check_that(self%has_tangent, "the last evaluation was one without tangent", error)
      if (allocated(error)) return
      associate (set => self%march%active%set, system => self%march%system)
         if (.not. with_contact .or. set%n == 0) then
            matrix = system%matrix
            return
         end if
         call constraints_merge_pattern(set, system%matrix, matrix, slot)
         do k = 1, size(slot)
            matrix%value(slot(k)) = system%matrix%value(k)
         end do
         call constraints_add_curvature(set, system%space%numbering, matrix)
      end associate
   end subroutine query_tangent

   !> Unknown of each degree of freedom, from 1; 0: prescribed, dependent, or of no element.
   subroutine query_unknowns(stepper, unknown, error)
      type(stepper_t), intent(in) :: stepper
      integer, allocatable, intent(out) :: unknown(:, :)     !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      if (.not. allocated(error)) unknown = stepper%march%system%space%numbering%unknown
   end subroutine query_unknowns

   !> The consistent mass between nodes, the same in both directions [M].
   subroutine query_mass(stepper, matrix, error)
      type(stepper_t), intent(in) :: stepper
      type(csr_t), intent(out) :: matrix             !! (n_node x n_node)
      type(error_t), allocatable, intent(out) :: error

      call stepper_check_open(stepper, error)
      if (.not. allocated(error)) call terms_mass(stepper%march%system%term, matrix)
   end subroutine query_mass

   !> Linear momenta and angular momentum about the origin of each body in the present state.
   subroutine query_momenta(self, stepper, momenta, error)
      type(query_t), intent(inout) :: self
      type(stepper_t), intent(in) :: stepper
      !> (3, n_body) px, py [M L/T], lz [M L^2/T]; in space (6, n_body), px to pz and lx to lz
      real(wp), allocatable, intent(out) :: momenta(:, :)
      type(error_t), allocatable, intent(out) :: error

      call query_sync(self, stepper, error)
      if (allocated(error)) return
      associate (n_dim => stepper%scene%n_dim)
         allocate(momenta(n_dim + n_turn(n_dim), self%march%system%space%n_body))
      end associate
      call body_momenta(self%march%system, stepper%scene%x, self%march%state, momenta)
   end subroutine query_momenta

end module emcon_stepper_query
