!> Velocities of a rigid body that is pushed and turns, against Newton's and Euler's laws.
module test_rigid_pushes
   use check, only : check_near, check_true, test_case_t
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_select
   use emcon_csr, only : csr_multiply
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_t, instant_t
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_of, motion_t
   use emcon_numbering, only : add_to_dofs, numbering_init, numbering_t, pick_unknowns, &
      spread_dependent
   use emcon_rigid_bodies, only : rigid_frame_choose
   use emcon_rigid_rotation, only : rigid_rotation_init, rigid_rotation_measure, &
      rigid_rotation_spin, rigid_rotation_t
   use emcon_rigidity, only : rigidity_init, rigidity_t
   use emcon_scene, only : scene_t
   use emcon_scheme_energy_momentum, only : scheme_energy_momentum_t
   use emcon_steps, only : load_moment, load_t, method_saddle_point, prescribed_t
   use emcon_system, only : system_begin_step, system_init, system_respond, system_t
   use emcon_term, only : role_external
   use emcon_text, only : to_text
   use emcon_velocity_mass, only : velocity_update_free, velocity_update_t
   use emcon_velocity_update, only : push_t, velocity_update_accelerate, velocity_update_push
   use random_draws, only : draw_random
   use small_scenes, only : add_load, add_step, block_t, make_block, shake
   implicit none
   private
   public :: collect_rigid_pushes

   real(wp), parameter :: tol = 1.0e3_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   integer, parameter :: n = 15
   !> Of a rectangle of 4 x 2 with density 1.
   real(wp), parameter :: mass = 8.0_wp, inertia = mass*20.0_wp/12.0_wp, center(2) = [2.0_wp, &
      1.0_wp]

   !> A body that turns, forces on its nodes.
   type :: body_t
      type(scene_t) :: scene
      type(system_t) :: system
      type(constraint_set_t) :: held
      type(velocity_update_t) :: update
      real(wp) :: arm(2, n) = 0.0_wp, v(2, n) = 0.0_wp, force(2, n) = 0.0_wp
      real(wp) :: total(2) = 0.0_wp, moment = 0.0_wp   !! of the forces
   end type body_t

   real(wp), parameter :: velocity(2) = [0.75_wp, -0.5_wp], spin = 1.5_wp

contains

   subroutine collect_rigid_pushes(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("forces accelerate a body that turns", test_accelerate), &
         test_case_t("a push gives an energy and leaves the shape", test_push), &
         test_case_t("what prescribed nodes leave of a shape", test_idle), &
         test_case_t("angle, moment of reactions and spin", test_rotation), &
         test_case_t("a moment turns a body and does not move it", test_moment)]
   end subroutine collect_rigid_pushes

   !> All nodes of a block are one body, about its first node.
   subroutine make_rigid(scene)
      type(scene_t), intent(out) :: scene
      type(block_t) :: block
      integer :: i

      call make_block(scene, "CPE4", [4, 2], block)
      deallocate(scene%rigid)
      allocate(scene%rigid(1))
      associate (body => scene%rigid(1))
         body%name = "BLOCK"
         body%reference = 1
         body%element = [(i, i = 1, 8)]
         body%node = [(i, i = 1, n)]
         call rigid_frame_choose(scene%x, body%node, body%reference, body%frame)
      end associate
      call add_step(scene, .false., 0.1_wp, 1)
   end subroutine make_rigid

   !> With unknowns of the frame alone, or of all nodes.
   subroutine begin(body, is_reduced, error)
      type(body_t), intent(out) :: body
      logical, intent(in) :: is_reduced
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      call make_rigid(body%scene)
      if (.not. is_reduced) body%scene%step(1)%contact%method = method_saddle_point
      associate (system => body%system)
         call system_init(system, body%scene, error)
         if (.not. allocated(error)) call system_begin_step(system, body%scene, 1, error)
         if (allocated(error)) return
         call constraints_select(body%held, pack([(k, k = 1, size(system%acts))], system%acts))
         call constraints_evaluate(body%held, system, motion_of(evaluation_at_end, body%scene%x, &
            0.0_wp*body%scene%x, 0.0_wp*body%scene%x))
      end associate
      body%arm = body%scene%x - spread(center, 2, n)
      body%v = rigid_field(body%arm, velocity, spin)
      call shake(body%force, 1.0_wp)
      body%total = sum(body%force, 2)
      body%moment = sum(body%arm(1, :)*body%force(2, :) - body%arm(2, :)*body%force(1, :))

   end subroutine begin

   pure function rigid_field(arm, velocity, spin) result(v)
      real(wp), intent(in) :: arm(2, n), velocity(2), spin
      real(wp) :: v(2, n)

      v(1, :) = velocity(1) - spin*arm(2, :)
      v(2, :) = velocity(2) + spin*arm(1, :)
   end function rigid_field

   !> Forces and their moment, and towards the centre what turns on a circle.
   subroutine test_accelerate(error)
      type(error_t), allocatable, intent(out) :: error
      type(body_t) :: body
      real(wp) :: acceleration(2, n)
      integer :: i

      do i = 1, 2
         call begin(body, i == 1, error)
         if (allocated(error)) return
         call velocity_update_accelerate(body%update, body%system, body%held, body%force, body%v, &
            acceleration, error)
         if (allocated(error)) return
         call check_near(error, acceleration, rigid_field(body%arm, body%total/mass, &
            body%moment/inertia) - spin**2*body%arm, tol, 10.0_wp, "acceleration " // to_text(i))
         call velocity_update_free(body%update)
      end do
   end subroutine test_accelerate

   !> Along the impulses s b + s^2 a/2 is the energy, with b and a of the body as a whole.
   subroutine test_push(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: gain(3) = [0.5_wp, -0.001_wp, -1.0e3_wp]
      type(body_t) :: body
      real(wp) :: v(2, n), a, b, root(2), part
      logical :: has_root
      integer :: k

      call begin(body, .true., error)
      if (allocated(error)) return
      a = sum(body%total**2)/mass + body%moment**2/inertia
      b = dot_product(body%total, velocity) + body%moment*spin
      do k = 1, size(gain)
         v = body%v
         call velocity_update_push(body%update, body%system, body%held, push_t(body%force, &
            gain(k)), v, has_root, error)
         if (allocated(error)) return
         call check_true(error, has_root .eqv. b**2 + 2.0_wp*a*gain(k) >= 0.0_wp, "root " &
            // to_text(k))
         part = 0.0_wp
         if (has_root) then
            root = (-b + [1.0_wp, -1.0_wp]*sqrt(b**2 + 2.0_wp*a*gain(k)))/a
            part = root(minloc(abs(root), 1))
         end if
         call check_near(error, v, rigid_field(body%arm, velocity + part*body%total/mass, spin &
            + part*body%moment/inertia), tol, 10.0_wp, "velocities, push " // to_text(k))
      end do
      call velocity_update_free(body%update)
   end subroutine test_push

   !> A distance is not held between nodes that are prescribed in both directions: of the three the
   !> one between the first two, or none.
   subroutine test_idle(error)
      type(error_t), allocatable, intent(out) :: error
      logical, parameter :: expected(3, 0:4) = reshape([.false., .false., .false., .false., &
         .false., .false., .false., .false., .false., .true., .false., .false., .true., .true., &
         .true.], [3, 5])
      !> Freedoms of the first nodes of the frame that are prescribed.
      integer, parameter :: n_given(0:4) = [0, 2, 3, 4, 6]
      type(scene_t) :: scene
      type(rigidity_t) :: rigidity
      type(numbering_t) :: numbering
      type(prescribed_t) :: given(6)
      logical :: is_alive(2, n), is_idle(3)
      integer :: i

      call make_rigid(scene)
      call rigidity_init(rigidity, scene%rigid)
      do i = 1, 6
         given(i)%node = scene%rigid(1)%frame(ishft(i + 1, -1))
         given(i)%dof = 2 - mod(i, 2)
      end do
      is_alive = .true.
      do i = 0, 4
         call numbering_init(numbering, is_alive, given(:n_given(i)))
         call rigidity%find_idle(numbering, is_idle)
         call check_true(error, all(is_idle .eqv. expected(:, i)), to_text(n_given(i)) &
            // " are given")
      end do
   end subroutine test_idle

   !> Turned before and over a step; reactions on the frame and on arms act where loads do.
   subroutine test_rotation(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: before = 0.75_wp, by = -0.5_wp
      integer, parameter :: arm(2) = [7, 9]
      type(scene_t) :: scene
      type(rigid_rotation_t) :: rotation
      type(motion_t) :: motion
      real(wp), dimension(2, n) :: u0, du, reaction, v
      real(wp) :: place(2), moment
      integer :: k, i

      call make_rigid(scene)
      u0 = turned(before, scene%x) - scene%x
      du = turned(before + by, scene%x) - scene%x - u0
      call shake(reaction, 1.0_wp)
      motion = motion_of(evaluation_t(is_gradient=.true., load_place=0.5_wp), scene%x, u0, du)
      do k = 1, 2
         if (k == 2) scene%rigid(1)%arm = arm
         call rigid_rotation_init(rotation, scene%rigid, scene%x, u0)
         call check_near(error, rotation%angle, [before], tol, 1.0_wp, "angle")
         rotation%moment = 5.0_wp
         call rigid_rotation_measure(rotation, scene%rigid, motion, reaction)
         call check_near(error, rotation%angle, [before + by], tol, 1.0_wp, "it turns")
         moment = 0.0_wp
         associate (frame => scene%rigid(1)%frame)
            do i = 2, 3
               place = scene%x(:, frame(i)) + u0(:, frame(i)) + 0.5_wp*du(:, frame(i)) &
                  - (scene%x(:, frame(1)) + u0(:, frame(1)) + 0.5_wp*du(:, frame(1)))
               moment = moment + place(1)*reaction(2, frame(i)) - place(2)*reaction(1, frame(i))
               if (k == 2) moment = moment + place(1)*reaction(2, arm(i - 1)) &
                  - place(2)*reaction(1, arm(i - 1))
            end do
         end associate
         call check_near(error, rotation%moment, [moment], tol, 4.0_wp, "moment")
      end do
      v = rigid_field(scene%x + u0, velocity, spin)
      call check_near(error, rigid_rotation_spin(scene%rigid(1), scene%x, u0, v), spin, tol, &
         1.0_wp, "spin")
   end subroutine test_rotation

   !> Two moments on one body, at once and by an amplitude: a couple of the sum at any place, whose
   !> change with the place is in the matrix.
   subroutine test_moment(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: step = epsilon(1.0_wp)**(1.0_wp/3.0_wp), value(2) = [3.0_wp, -0.5_wp]
      type(scheme_energy_momentum_t) :: scheme
      type(scene_t) :: scene
      type(system_t) :: system
      type(load_t) :: load
      real(wp), dimension(2, n) :: u0, du, way, place
      real(wp), allocatable :: x(:), product(:), up(:), down(:)
      integer :: k

      way = 0.0_wp
      call make_rigid(scene)
      deallocate(scene%amplitude)
      allocate(scene%amplitude(1))
      scene%amplitude(1)%time = [0.0_wp, 1.0_wp]
      scene%amplitude(1)%value = [0.0_wp, 20.0_wp]
      load%kind = load_moment
      load%target = 1
      do k = 1, 2
         load%value = value(k)
         load%amplitude = k - 1
         call add_load(scene%step(1), load)
      end do
      call system_init(system, scene, error)
      if (.not. allocated(error)) call system_begin_step(system, scene, 1, error)
      if (allocated(error)) return
      u0 = turned(0.5_wp, scene%x) - scene%x
      call shake(du, 0.1_wp)
      call spread_dependent(system%space%numbering, du)
      call system_respond(system, motion_at(0.0_wp), .true.)
      ! In the middle of the step, at 0.05, the second one is there in full.
      associate (force => system%response%part(role_external)%force)
         place = scene%x + u0 + 0.5_wp*du
         call check_near(error, sum(force, 2), [0.0_wp, 0.0_wp], tol, 1.0_wp, "no force")
         call check_near(error, sum(place(1, :)*force(2, :) - place(2, :)*force(1, :)), &
            sum(value), tol, 10.0_wp, "moment")
      end associate
      allocate(x(system%space%numbering%n_unknown))
      allocate(product, up, down, mold=x)
      call draw_random(x)
      way = 0.0_wp
      call add_to_dofs(system%space%numbering, x, 1.0_wp, way)
      call csr_multiply(system%matrix, x, product)
      call system_respond(system, motion_at(step), .false.)
      call pick_unknowns(system%space%numbering, system%response%residual, up)
      call system_respond(system, motion_at(-step), .false.)
      call pick_unknowns(system%space%numbering, system%response%residual, down)
      call check_near(error, (up - down)/(2.0_wp*step), product, max(1.0e3_wp*step**2, tol), &
         maxval(abs(product)), "tangent")

   contains

      type(motion_t) function motion_at(share) result(motion)
         real(wp), intent(in) :: share

         motion = motion_of(scheme%evaluation(instant_t(), 0.1_wp), scene%x, u0, du + share*way)
      end function motion_at

   end subroutine test_moment

   !> The places `x`, turned about the origin.
   pure function turned(angle, x) result(place)
      real(wp), intent(in) :: angle, x(2, n)
      real(wp) :: place(2, n)

      place(1, :) = cos(angle)*x(1, :) - sin(angle)*x(2, :)
      place(2, :) = sin(angle)*x(1, :) + cos(angle)*x(2, :)
   end function turned

end module test_rigid_pushes
