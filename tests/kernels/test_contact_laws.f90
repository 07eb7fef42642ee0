!> Laws of a condition side by side: what of a pair's is copied, what they respond and take in sum.
module test_contact_laws
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : contact_response_t
   use emcon_contact_law, only : contact_law_t, contact_laws_add, contact_laws_begin, &
      contact_laws_dissipated, contact_laws_rate_change, contact_laws_reach, contact_laws_respond, &
      contact_laws_rub, contact_laws_t, contact_place_t, contact_values_t, loss_damping, &
      loss_friction
   use emcon_contact_law_registry, only : contact_law_of_method, contact_laws_of_surface
   use emcon_coulomb_law, only : contact_slides, coulomb_t, slip_status_t
   use emcon_dashpot_law, only : dashpot_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_damping_t, interaction_t
   use emcon_kinds, only : wp
   use emcon_penalty_law, only : augmented_t, penalty_t
   use emcon_restitution_law, only : restitution_t
   use emcon_steps, only : method_augmented_lagrange, method_null_space, method_penalty
   implicit none
   private
   public :: collect_contact_laws

   real(wp), parameter :: tol = 16.0_wp*epsilon(1.0_wp)

   type, extends(contact_law_t) :: plain_t
   contains
      procedure :: respond => plain_respond
   end type plain_t

contains

   subroutine collect_contact_laws(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("laws that a deck asks for", test_asked), &
         test_case_t("copies of a pair's laws", test_begin), &
         test_case_t("a law that says no more", test_plain), &
         test_case_t("forces and losses in sum", test_respond), &
         test_case_t("friction that turns with slip", test_turns), &
         test_case_t("rates that impacts change", test_rates)]
   end subroutine collect_contact_laws

   !> A new law says nothing but what it responds, and acts wherever it is near; decks do not know
   !> it.
   subroutine test_plain(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_laws_t) :: of_pair, laws
      type(contact_response_t) :: response
      type(plain_t) :: law
      logical :: acts

      call law%take(interaction_t(friction=0.5_wp, restitution=0.5_wp), method_penalty, acts)
      call law%begin(contact_place_t(area=2.0_wp, closure=-1.0_wp))
      call law%push_on(3.0_wp)
      call check_true(error, .not. (acts .or. law%gives_back()), "no deck asks for it")
      call check_near(error, [law%stored(), law%dissipated(contact_values_t(dgap=-1.0_wp), &
         contact_response_t(lam=7.0_wp)), law%stiffest(), law%closure(), law%rate_change(2.0_wp)], &
         spread(0.0_wp, 1, 5), 0.0_wp, 1.0_wp, "what it does not say")
      call contact_laws_add(of_pair, plain_t())
      call check_near(error, contact_laws_reach(of_pair), 0.0_wp, 0.0_wp, 1.0_wp, "at contact")
      call contact_laws_begin(laws, of_pair, contact_place_t())
      call check_true(error, allocated(laws%beside), "it acts")
      if (allocated(error)) return
      call contact_laws_respond(laws, contact_values_t(), response)
      call check_near(error, response%lam, 7.0_wp, 0.0_wp, 1.0_wp, "its force")
   end subroutine test_plain

   pure subroutine plain_respond(self, at, response)
      class(plain_t), intent(inout) :: self
      type(contact_values_t), intent(in) :: at
      type(contact_response_t), intent(inout) :: response

      response%lam = 7.0_wp
   end subroutine plain_respond

   !> Friction, damping and restitution, where there is any of them; a law for each method.
   subroutine test_asked(error)
      type(error_t), allocatable, intent(out) :: error
      type(interaction_t) :: surface
      type(contact_laws_t) :: laws
      class(contact_law_t), allocatable :: law

      call contact_laws_of_surface(surface, laws)
      call check_true(error, .not. allocated(laws%beside), "none")
      call check_true(error, .not. contact_laws_rub(laws), "nothing rubs")
      call check_near(error, [contact_laws_reach(laws), contact_laws_rate_change(laws, 1.0_wp), &
         contact_laws_dissipated(laws, contact_values_t(), loss_friction)], [-1.0_wp, 0.0_wp, &
         0.0_wp], 0.0_wp, 1.0_wp, "no laws")
      surface%friction = 0.3_wp
      call contact_laws_of_surface(surface, laws)
      call check_equal(error, size(laws%beside), 1, "friction")
      call check_true(error, contact_laws_rub(laws), "it rubs")
      surface%damping = contact_damping_t(3.0_wp, 0.5_wp, 0.0_wp, 1.0_wp)
      surface%restitution = 0.25_wp
      call contact_laws_of_surface(surface, laws)
      call check_equal(error, size(laws%beside), 3, "friction, damping, restitution")
      call check_near(error, [contact_laws_reach(laws), contact_laws_rate_change(laws, 2.0_wp)], &
         [0.5_wp, -1.5_wp], tol, 1.0_wp, "reach and change")
      surface%friction = 0.0_wp
      surface%damping%tangent = 0.0_wp
      call contact_laws_of_surface(surface, laws)
      call check_true(error, size(laws%beside) == 2 .and. .not. contact_laws_rub(laws), &
         "damping along the normal")
      call contact_law_of_method(method_null_space, law)
      call check_true(error, .not. allocated(law), "rows hold")
      call contact_law_of_method(method_penalty, law)
      call check_true(error, same_type_as(law, penalty_t()), "a penalty")
      call contact_law_of_method(method_augmented_lagrange, law)
      call check_true(error, same_type_as(law, augmented_t()), "an augmented Lagrangian")
   end subroutine test_asked

   !> Those that act on what is near, beside those that are there, at their place.
   subroutine test_begin(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_laws_t) :: of_pair, laws

      call contact_laws_begin(laws, of_pair, contact_place_t())
      call check_true(error, .not. allocated(laws%beside), "nothing to copy")
      call contact_laws_add(of_pair, coulomb_t(mu=0.5_wp))
      call contact_laws_add(of_pair, dashpot_t(reach=0.25_wp))
      call contact_laws_add(of_pair, dashpot_t(reach=0.75_wp))
      call contact_laws_add(of_pair, restitution_t(reach=5.0_wp))
      call contact_laws_add(laws, coulomb_t(mu=0.1_wp))
      call contact_laws_begin(laws, of_pair, contact_place_t(area=3.0_wp, share=0.5_wp, &
         gap=0.1_wp, is_closed=.true.))
      call check_equal(error, size(laws%beside), 3, "two more")
      call check_near(error, contact_laws_reach(laws), 0.75_wp, 0.0_wp, 1.0_wp, "the farthest")
      select type (law => laws%beside(3)%law)
      type is (dashpot_t)
         call check_near(error, [law%area, law%gap, law%reach], [1.5_wp, 0.1_wp, 0.75_wp], tol, &
            1.0_wp, "its place")
         call check_true(error, law%is_closed, "closed")
      class default
         call check_true(error, .false., "the last one is a dashpot")
      end select
   end subroutine test_begin

   !> A dashpot of 3 on an area of 2 at closed contact, sliding friction, and what rows stick with.
   subroutine test_respond(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_laws_t) :: laws
      type(contact_response_t) :: response
      type(contact_values_t) :: at
      type(dashpot_t) :: dashpot
      integer :: k

      call contact_laws_add(laws, coulomb_t(loss=loss_friction, mu=0.5_wp, status=slip_status_t( &
         contact_slides, [0.6_wp, 0.8_wp])))
      dashpot = dashpot_t(coefficients=contact_damping_t(3.0_wp, 0.5_wp, 0.0_wp, 0.25_wp), &
         area=2.0_wp, is_closed=.true.)
      call contact_laws_add(laws, dashpot)
      call contact_laws_add(laws, dashpot)
      response%lam = 7.0_wp
      response%tau = 7.0_wp
      response%stick = [0.5_wp, -0.5_wp]
      at = contact_values_t(gap0=-0.1_wp, gap1=-0.2_wp, dgap=-0.1_wp, slip=[0.3_wp, -0.2_wp], &
         friction=[2.0_wp, 1.0_wp], frequency=10.0_wp)
      do k = 1, 2                                ! what was before is forgotten
         call contact_laws_respond(laws, at, response)
      end do
      call check_near(error, response%lam, 2.0_wp*6.0_wp, tol, 10.0_wp, "push")
      call check_near(error, response%tau, 2.0_wp*15.0_wp*at%slip, tol, 10.0_wp, "drag")
      call check_near(error, response%mu_sigma, [0.3_wp, 0.4_wp], tol, 1.0_wp, "tilt")
      call check_near(error, response%stick, [0.5_wp, -0.5_wp], 0.0_wp, 1.0_wp, "rows")
      call check_near(error, [response%stiffness(0, 0), response%stiffness(1, 1), &
         response%stiffness(2, 2)], [120.0_wp, 30.0_wp, 30.0_wp], tol, 100.0_wp, "stiffness")
      call check_near(error, contact_laws_dissipated(laws, at, loss_friction), 0.4_wp, tol, &
         1.0_wp, "friction takes")
      call check_near(error, contact_laws_dissipated(laws, at, loss_damping), 2.0_wp*(0.6_wp &
         + 15.0_wp*0.13_wp), tol, 10.0_wp, "damping takes")
   end subroutine test_respond

   !> Friction that turns is against the slip there is, less where it is led to, but not against its
   !> own way, nor by what is round-off.
   subroutine test_turns(error)
      type(error_t), allocatable, intent(out) :: error
      type(coulomb_t) :: law
      type(contact_response_t) :: response
      real(wp), parameter :: friction(2) = [2.0_wp, 0.0_wp], step = 1.0e-6_wp
      real(wp) :: slip(2)
      integer :: k

      law = coulomb_t(mu=0.5_wp, status=slip_status_t(contact_slides, [1.0_wp, 0.0_wp]), &
         turns=.true.)
      slip = [-1.0e-3_wp, 0.4_wp]
      call law%respond(contact_values_t(slip=slip, friction=friction), response)
      call check_near(error, response%mu_sigma, [0.5_wp, 0.0_wp], tol, 1.0_wp, "turns back")
      call check_near(error, maxval(abs(response%stiffness)), 0.0_wp, tol, 1.0_wp, "is not soft")
      slip = [0.1_wp*epsilon(1.0_wp), epsilon(1.0_wp)]
      call law%respond(contact_values_t(slip=slip, friction=friction, size=1.0_wp), response)
      call check_near(error, response%mu_sigma, [0.5_wp, 0.0_wp], tol, 1.0_wp, "round-off")
      slip = [0.3_wp, 0.4_wp]
      call law%respond(contact_values_t(slip=slip, friction=friction, size=1.0_wp), response)
      call check_near(error, response%mu_sigma, [0.3_wp, 0.4_wp], tol, 1.0_wp, "against slip")
      do k = 1, 2
         slip = [0.3_wp, 0.4_wp]
         slip(k) = slip(k) + step
         call check_near(error, 2.0_wp*(slip/norm2(slip) - [0.6_wp, 0.8_wp]), &
            step*response%stiffness(1:2, k), 10.0_wp*step*step, 1.0_wp, "by slip")
      end do
      law%slip_target = [1.0_wp, 0.0_wp]
      slip = [0.3_wp, 0.2_wp]
      response = contact_response_t()
      call law%respond(contact_values_t(slip=slip, friction=friction, size=1.0_wp), response)
      call check_near(error, response%mu_sigma, [0.0_wp, 0.5_wp], tol, 1.0_wp, "free along its way")
      call check_near(error, maxval(abs(response%stiffness)), 0.0_wp, tol, 1.0_wp, "across")
   end subroutine test_turns

   !> What parts is slowed down, by the sum of all, and so is what approaches.
   subroutine test_rates(error)
      type(error_t), allocatable, intent(out) :: error
      type(contact_laws_t) :: laws

      call contact_laws_add(laws, restitution_t(part=0.75_wp))
      call contact_laws_add(laws, coulomb_t(mu=0.5_wp))
      call contact_laws_add(laws, restitution_t(part=0.5_wp))
      call check_near(error, contact_laws_rate_change(laws, 4.0_wp), -3.0_wp, tol, 4.0_wp, "parts")
      call check_near(error, contact_laws_rate_change(laws, -4.0_wp), 3.0_wp, tol, 4.0_wp, &
         "approaches")
   end subroutine test_rates

end module test_contact_laws
