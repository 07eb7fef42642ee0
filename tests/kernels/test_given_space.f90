!> Elements in three dimensions whose law is given at points, against a law of ours, the same one.
module test_given_space
   use check, only : check_near, check_true, test_case_t
   use emcon_element_space, only : space_element_hold, space_element_init, space_element_respond, &
      space_element_t, space_motion_t, space_part_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_t
   use emcon_user_space, only : user_space_hold, user_space_respond, user_space_strain
   use emcon_host_law, only : host_points_make_room, host_points_t
   use emcon_kinds, only : wp
   use emcon_law, only : lame_constants, law_t
   use emcon_law_registry, only : law_create, law_linear
   use emcon_motion, only : motion_of, motion_t
   use emcon_point_function, only : point_function_t, point_gradient, point_ok
   use emcon_shape, only : m => max_element_nodes
   use emcon_shape_hexahedron_space, only : shape_hexahedron_t
   use emcon_solid, only : solid_t
   use emcon_stepper, only : stepper_build, stepper_close, stepper_t
   use emcon_stepper_user, only : stepper_give_law
   use emcon_stress, only : nodal_stress
   use emcon_system, only : system_find_energy, system_respond, system_tangent_times
   use emcon_term, only : role_internal
   use emcon_term_registry, only : terms_solid
   use one_element, only : law_given, read_one
   use small_scenes, only : poisson, shake, young
   implicit none
   private
   public :: collect_user_space

   real(wp), parameter :: eps = epsilon(1.0_wp)
   !> Sums over 8 points and nodes, each term of some dozen roundings; as test_element_space.
   real(wp), parameter :: tol = 1024.0_wp*eps
   integer, parameter :: n_strain = 6, n_gp = 8

   !> W = z.D z/2.
   type, extends(point_function_t) :: quadratic_t
      real(wp) :: moduli(n_strain, n_strain) = 0.0_wp
   contains
      procedure :: evaluate
   end type quadratic_t

   type :: sample_t
      type(space_element_t) :: element
      class(law_t), allocatable :: law
      type(quadratic_t) :: given
      type(host_points_t) :: points
   end type sample_t

contains

   subroutine collect_user_space(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces and tangents of our own law", test_forces), &
         test_case_t("stress of our own law", test_stress), &
         test_case_t("an inverted element is told", test_inverted), &
         test_case_t("models of one element", test_models)]
   end subroutine collect_user_space

   subroutine evaluate(self, z, wants_hessian, value, gradient, hessian, status)
      class(quadratic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: z(:, :)
      logical, intent(in) :: wants_hessian
      real(wp), intent(inout), contiguous :: value(:)
      real(wp), intent(inout), contiguous :: gradient(:, :)
      real(wp), intent(inout), contiguous :: hessian(:, :, :)
      integer, intent(out) :: status
      integer :: i

      status = point_ok
      do i = 1, size(z, 2)
         associate (moduli => self%moduli(:size(z, 1), :size(z, 1)))
            gradient(:, i) = matmul(moduli, z(:, i))
            value(i) = 0.5_wp*dot_product(z(:, i), gradient(:, i))
            if (wants_hessian) hessian(:, :, i) = moduli
         end associate
      end do
   end subroutine evaluate

   !> A distorted hexahedron; its law twice. Its points stand behind others.
   subroutine make_sample(sample, error)
      type(sample_t), intent(out) :: sample
      type(error_t), allocatable, intent(out) :: error
      type(shape_hexahedron_t) :: shape
      real(wp), allocatable :: place(:, :)
      real(wp) :: move(3, m), lam, mu
      integer :: i

      call shape%places(place)
      call shake(move, 0.2_wp)
      call space_element_init(sample%element, shape, place + move(:, :size(place, 2)))
      call law_create(law_linear, [young, poisson], sample%law, error)
      call lame_constants(young, poisson, lam, mu)
      sample%given%n_variable = n_strain
      do i = 1, n_strain
         sample%given%moduli(i, i) = merge(2.0_wp*mu, mu, i <= 3)
      end do
      sample%given%moduli(:3, :3) = sample%given%moduli(:3, :3) + lam
      sample%given%weight = [1.0_wp, 1.0_wp, 1.0_wp, 0.5_wp, 0.5_wp, 0.5_wp]
      call host_points_make_room(sample%points, n_strain, n_gp + 1)
   end subroutine make_sample

   subroutine answer(sample, motion, is_inverted)
      type(sample_t), intent(inout) :: sample
      type(space_motion_t), intent(in) :: motion
      logical, intent(out) :: is_inverted
      integer :: status

      call user_space_strain(sample%element, 2, motion, sample%points, is_inverted)
      if (.not. is_inverted) call point_gradient(sample%given, sample%points%strain, &
         sample%points%dstrain, .true., sample%points%response, status)
   end subroutine answer

   subroutine test_forces(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_motion_t) :: motion
      type(space_part_t) :: one, other
      logical :: is_inverted
      integer :: k

      call make_sample(sample, error)
      do k = 1, 6
         motion%square = real(mod(k + 1, 2), wp)
         call shake(motion%from, 0.2_wp)
         call shake(motion%by, 0.2_wp)
         call answer(sample, motion, is_inverted)
         call check_true(error, .not. is_inverted, "not inverted")
         call user_space_respond(sample%element, 2, sample%points, motion, .true., one)
         call space_element_respond(sample%element, sample%law, motion, .true., other)
         call check_near(error, one%energy, other%energy, tol, young, "energy")
         call check_near(error, one%force(:, :8), other%force(:, :8), tol, young, "force")
         call check_near(error, one%magnitude(:, :8), other%magnitude(:, :8), tol, young, "sizes")
         call check_near(error, reshape(one%tangent(:, :8, :, :8), [24, 24]), &
            reshape(other%tangent(:, :8, :, :8), [24, 24]), tol, young, "tangent")
      end do
   end subroutine test_forces

   subroutine test_stress(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_motion_t) :: motion
      real(wp), dimension(n_strain, n_gp) :: stress, strain, wanted, wanted_strain
      logical :: is_inverted

      call make_sample(sample, error)
      call shake(motion%from, 0.2_wp)
      call answer(sample, motion, is_inverted)
      call user_space_hold(sample%element, 2, sample%points, motion, stress, strain)
      call space_element_hold(sample%element, sample%law, motion, wanted, wanted_strain)
      call check_near(error, stress, wanted, tol, young, "stress")
      call check_near(error, strain, wanted_strain, tol, 1.0_wp, "strain")
      call user_space_hold(sample%element, 0, sample%points, motion, stress, strain)
      call check_true(error, all(stress /= stress), "no answer, no stress")
      call check_near(error, strain, wanted_strain, tol, 1.0_wp, "strain")
   end subroutine test_stress

   subroutine test_inverted(error)
      type(error_t), allocatable, intent(out) :: error
      type(sample_t) :: sample
      type(space_motion_t) :: motion
      logical :: is_inverted

      call make_sample(sample, error)
      motion%by(1, 1) = 5.0_wp
      call answer(sample, motion, is_inverted)
      call check_true(error, is_inverted, "inverted")
   end subroutine test_inverted

   !> Forces, energies, products with the tangent and stress as those of a model with our own law,
   !> in space and in the plane; what is inverted is refused by both.
   subroutine test_models(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: kind(4) = ["C3D8 ", "C3D10", "C3D4 ", "CPE4 "]
      type(sample_t) :: sample
      integer :: k

      call make_sample(sample, error)
      do k = 1, size(kind)
         if (.not. allocated(error)) call compare_models(trim(kind(k)), sample%given, error)
      end do
   end subroutine test_models

   subroutine compare_models(kind, given, error)
      character(len=*), intent(in) :: kind
      type(quadratic_t), intent(in) :: given
      type(error_t), allocatable, intent(out) :: error
      !> Strains of the plane among those of space.
      integer, parameter :: in_plane(3) = [1, 2, 4]
      type(stepper_t), target :: own, other
      type(quadratic_t) :: law
      real(wp), allocatable :: u0(:, :), du(:, :)
      integer :: k

      law = given
      if (kind(:3) == "CPE") then
         law%n_variable = 3
         law%weight = given%weight(in_plane)
         law%moduli(:3, :3) = given%moduli(in_plane, in_plane)
      end if
      call read_one(kind, 1, "NONLINEAR", own, error)
      if (.not. allocated(error)) call stepper_build(own, error)
      if (.not. allocated(error)) call read_one(kind, law_given, "NONLINEAR", other, error)
      if (.not. allocated(error)) call stepper_give_law(other, "M", law, error)
      if (.not. allocated(error)) call stepper_build(other, error)
      if (allocated(error)) return
      allocate(u0, du, source=0.0_wp*own%scene%x)
      do k = 1, 8
         call shake(u0, 0.1_wp)
         call shake(du, 0.05_wp*k)
         ! Far away both see what is between their nodes.
         if (k > 4 .and. size(u0, 1) == 3) u0 = u0 + 1.0e4_wp
         call compare_at(kind, own, other, u0, du, error)
         if (allocated(error)) return
      end do
      call stepper_close(own)
      call stepper_close(other)
   end subroutine compare_models

   subroutine compare_at(kind, own, other, u0, du, error)
      character(len=*), intent(in) :: kind
      type(stepper_t), intent(inout), target :: own, other
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      type(error_t), allocatable, intent(inout) :: error
      type(solid_t), pointer :: solid
      real(wp), dimension(size(du, 1), size(du, 2), 2) :: product
      real(wp) :: stress(6, size(du, 2), 2)
      type(motion_t) :: motion
      integer :: k

      associate (one => own%march%system, two => other%march%system, x => own%scene%x)
         motion = motion_of(evaluation_t(), x, u0, du)
         call system_respond(one, motion, .true.)
         call system_respond(two, motion, .true.)
         call check_true(error, allocated(one%response%refusal) .eqv. &
            allocated(two%response%refusal), kind // ": refused by both")
         if (allocated(one%response%refusal)) return
         call check_near(error, two%response%part(role_internal)%force, &
            one%response%part(role_internal)%force, tol, young, kind // ": forces")
         call system_tangent_times(one, motion, du, product(:, :, 1))
         call system_tangent_times(two, motion, du, product(:, :, 2))
         call check_near(error, product(:, :, 2), product(:, :, 1), tol, 10.0_wp*young, &
            kind // ": products")
         call system_find_energy(one, motion)
         call system_find_energy(two, motion)
         call check_near(error, sum(two%response%energy), sum(one%response%energy), tol, young, &
            kind // ": energy")
         do k = 1, 2
            if (k == 1) solid => terms_solid(one%term)
            if (k == 2) solid => terms_solid(two%term)
            call nodal_stress(solid, u0, 1.0_wp, stress(:, :, k))
         end do
      end associate
      ! In the plane the stress across is not known of a given law.
      if (size(du, 1) == 2) stress(3, :, :) = 0.0_wp
      call check_near(error, stress(:, :, 2), stress(:, :, 1), tol, young, kind // ": stress")
   end subroutine compare_at

end module test_given_space
