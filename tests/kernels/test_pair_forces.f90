!> What pairs transmit: sums over conditions against the forces of each one, to every node.
module test_pair_forces
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_constraint, only : condition_force
   use emcon_constraints, only : constraint_set_t, constraints_evaluate, constraints_lam, &
      constraints_select
   use emcon_contact, only : contact_t
   use emcon_contact_law, only : contact_laws_add, loss_friction
   use emcon_coulomb_law, only : coulomb_t
   use emcon_dashpot_law, only : dashpot_t
   use emcon_errors, only : error_t
   use emcon_evaluation, only : evaluation_at_end, evaluation_moving
   use emcon_interactions, only : contact_pair_t, formulation_mortar
   use emcon_kinds, only : wp
   use emcon_march, only : march_begin_step, march_free, march_init, march_t
   use emcon_motion, only : motion_init, motion_evaluate, motion_t
   use emcon_pair_record, only : pair_components, pair_record_init, pair_record_jump, &
      pair_record_measure, pair_record_t
   use emcon_pair_sums, only : pair_center, pair_force, pair_sum_t, pair_sums_add, &
      pair_sums_begin, pair_sums_init, pair_sums_jump, pair_sums_t
   use emcon_scene, only : scene_t
   use emcon_stand_off, only : stand_off_add, stand_off_mean, stand_off_t
   use emcon_system, only : system_t
   use emcon_velocity_jumps, only : velocity_jump_t
   use random_draws, only : draw_random
   use small_scenes, only : add_step, block_t, make_two_blocks, shake
   implicit none
   private
   public :: collect_pair_forces

   !> Of some dozens of forces of the size 1 at places of the size 3.
   real(wp), parameter :: tol = 512.0_wp*epsilon(1.0_wp)
   real(wp), parameter :: h = 0.25_wp

contains

   subroutine collect_pair_forces(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("pairs in both orders are one", test_order), &
         test_case_t("sums over a step", test_sums), &
         test_case_t("sums of statics", test_static_sums), &
         test_case_t("the record of both sides", test_record), &
         test_case_t("impulses of jumps", test_jumps), &
         test_case_t("air across which forces act", test_stand_off)]
   end subroutine collect_pair_forces

   !> Pair 2 and 3 are 1 and, exchanged, 4 the other way round.
   subroutine test_order(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: slave(5) = [2, 1, 4, 3, 5], master(5) = [1, 2, 3, 4, 6]
      type(contact_pair_t) :: pair(5)
      type(pair_sums_t) :: sums
      type(system_t) :: system

      pair%slave = slave
      pair%master = master
      pair(3)%is_exchanged = .true.
      allocate(system%contact(7))
      system%contact%of_pair = [1, 2, 3, 4, 5, -1, -3]
      call pair_sums_init(sums, system, pair)
      call check_equal(error, size(sums%sum), 3, "sums")
      call check_equal(error, sums%of_pair, [1, -1, -2, 2, 3, -1, 2], "pair of each contact")
   end subroutine test_order

   !> Two blocks in contact in both orders, by nodes and by integrals: every second condition has a
   !> row, others have laws alone. All have friction, and forces and losses by chance.
   subroutine begin(march, set, motion, is_static, error, is_apart)
      type(march_t), intent(inout) :: march
      type(constraint_set_t), intent(out) :: set
      type(motion_t), intent(out) :: motion
      logical, intent(in) :: is_static
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: is_apart  !! rows of the first contact, laws of the second
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      integer, allocatable :: near(:)
      integer :: i, k

      call make_two_blocks(scene, 0.02_wp, lower, upper)
      scene%pair(1)%interaction%friction = 0.3_wp
      scene%pair = [scene%pair, scene%pair]
      scene%pair(1)%formulation = formulation_mortar
      scene%pair(2)%slave = 1
      scene%pair(2)%master = 2
      call add_step(scene, .false., h, 1)
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      call motion_init(motion, scene%x)
      call shake(motion%u0, 0.03_wp)
      call shake(motion%du, 0.03_wp)
      motion%evaluation = evaluation_moving(h, 0.5_wp*h, 2.0_wp)
      if (is_static) motion%evaluation = evaluation_at_end
      call motion_evaluate(motion)
      near = [integer ::]
      do k = 1, size(march%system%contact)
         associate (contact => march%system%contact(k)%contact)
            call contact%begin_step(motion%x, motion%u0, motion%du)
            call contact%measure(motion%x, motion%u0, motion%du)
            near = [near, pack([(i, i = 1, contact%n_constraint)], contact%state%is_near &
               .and. contact%state%is_over) + march%system%first_constraint(k)]
         end associate
      end do
      if (present(is_apart)) then
         associate (last => march%system%first_constraint(2))
            call constraints_select(set, pack(near, near <= last), pack(near, near > last))
         end associate
      else
         call constraints_select(set, near(1::2), near(2::2))
      end if
      set%item%has_friction = .true.
      call constraints_evaluate(set, march%system, motion)
      do k = 1, set%n_condition
         call draw_responses(set, k)
      end do
   end subroutine begin

   subroutine draw_responses(set, k)
      type(constraint_set_t), intent(inout) :: set
      integer, intent(in) :: k

      call contact_laws_add(set%law(k), coulomb_t(loss=loss_friction, mu=0.3_wp))
      call contact_laws_add(set%law(k), dashpot_t())
      if (k <= set%n) call draw_random(set%lam(k))
      associate (response => set%item(k)%response, own => set%law(k)%beside(2)%response)
         call draw_random(response%mu_sigma(1))
         call draw_random(response%stick(1))
         if (mod(k, 3) > 0) then
            call draw_random(response%lam)
            call draw_random(response%tau(1))
         end if
         call draw_random(own%lam)
         call draw_random(own%tau(1))
      end associate
   end subroutine draw_responses

   !> Number of the contact of a condition.
   pure integer function contact_of(system, id) result(k)
      type(system_t), intent(in) :: system
      integer, intent(in) :: id

      k = count(system%first_constraint < id)
   end function contact_of

   !> Force on the surface that the first pair has as its slave, by the sizes of forces of rows and
   !> of laws at each node, and the same by places; what damping and friction take.
   subroutine sum_up(system, set, motion, part, force, weight, moment, loss)
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: part
      real(wp), intent(out) :: force(2), weight, moment(2), loss(2)
      real(wp) :: push(2, 2), lam, tau(2), place(2)
      integer :: k, i, j

      force = 0.0_wp
      weight = 0.0_wp
      moment = 0.0_wp
      loss = 0.0_wp
      do k = set%n_permanent + 1, set%n_condition
         lam = constraints_lam(set, k)
         associate (item => set%item(k), own => set%law(k)%beside(2)%response)
            tau = item%response%mu_sigma*item%normal*lam + item%response%stick
            do i = 1, item%n_slave
               associate (n => item%node(i))
                  place = motion%x(:, n) + motion%u0(:, n) + part*motion%du(:, n)
               end associate
               push(:, 1) = lam*item%g(:, i) - tau(1)*item%t(:, i, 1)
               push(:, 2) = item%response%lam*item%g(:, i) - item%response%tau(1)*item%t(:, i, 1)
               force = force + merge(1, -1, contact_of(system, set%id(k)) == 1)*sum(push, 2)
               do j = 1, 2
                  weight = weight + norm2(push(:, j))
                  moment = moment + norm2(push(:, j))*place
               end do
            end do
            loss = loss + [own%tau(1)*item%slip(1) - own%lam*item%dgap, tau(1)*item%slip(1)]
         end associate
      end do
   end subroutine sum_up

   !> Two steps of different sizes, of which the second one adds up with the first.
   subroutine test_sums(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(pair_sums_t) :: sums
      type(contact_pair_t) :: pair(2)
      real(wp) :: force(2), weight, moment(2), loss(2)

      call begin(march, set, motion, .false., error)
      if (allocated(error)) return
      pair%slave = [2, 1]
      pair%master = [1, 2]
      call pair_sums_init(sums, march%system, pair)
      call check_true(error, set%n > 2 .and. set%n_condition > set%n + 1, "of both kinds")
      call check_near(error, pair_force(sums%sum(1)), [0.0_wp, 0.0_wp, 0.0_wp], 0.0_wp, 1.0_wp, &
         "nothing yet")
      call check_near(error, pair_center(sums%sum(1), -1.0_wp), [-1.0_wp, -1.0_wp, -1.0_wp], &
         0.0_wp, 1.0_wp, "nowhere yet")
      call sum_up(march%system, set, motion, 0.5_wp, force, weight, moment, loss)
      call pair_sums_add(sums, march%system, set, motion, h)
      call pair_sums_add(sums, march%system, set, motion, 2.0_wp*h)
      associate (sum => sums%sum(1))
         call check_near(error, sum%push, 3.0_wp*h*[force, 0.0_wp], tol, 1.0_wp, "push")
         call check_near(error, sum%impulse, 3.0_wp*h*[force, 0.0_wp], tol, 1.0_wp, "impulse")
         call check_near(error, [sum%span, sum%duration], spread(3.0_wp*h, 1, 2), tol, 1.0_wp, &
            "times")
         call check_near(error, sum%weight, 3.0_wp*h*weight, tol, 10.0_wp, "sizes")
         call check_near(error, sum%moment, 3.0_wp*h*[moment, 0.0_wp], tol, 10.0_wp, "by places")
         call check_near(error, [sum%damping, sum%friction], 2.0_wp*loss, tol, 1.0_wp, "losses")
         call check_near(error, pair_force(sum), [force, 0.0_wp], tol, 10.0_wp, "mean force")
         call check_near(error, pair_center(sum, -1.0_wp), [moment/weight, 0.0_wp], tol, 10.0_wp, &
            "its place")
         call check_true(error, sum%is_pressed .and. minval(abs(loss)) > 0.0_wp, "pressed")
         set%lam = 0.0_wp
         call pair_sums_add(sums, march%system, set, motion, h)
         call check_near(error, [sum%span, sum%duration], [4.0_wp*h, 3.0_wp*h], tol, 1.0_wp, &
            "no multiplier is no force of rows")
         call pair_sums_begin(sum)
         call check_near(error, [sum%push, sum%moment, sum%span, sum%weight], &
            spread(0.0_wp, 1, 8), 0.0_wp, 1.0_wp, "an increment begins")
         call check_true(error, norm2(sum%impulse) > 0.0_wp, "impulses stay")
      end associate
      call march_free(march)
   end subroutine test_sums

   !> The last part alone, at the end of the motion; no impulse, no time. The first condition counts
   !> as one that always holds.
   subroutine test_static_sums(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(pair_sums_t) :: sums
      real(wp) :: force(2), weight, moment(2), loss(2)

      call begin(march, set, motion, .true., error)
      if (allocated(error)) return
      allocate(sums%sum(2), source=sums_of_nothing())
      sums%of_pair = [1, -1]
      set%n_permanent = 1
      call sum_up(march%system, set, motion, 1.0_wp, force, weight, moment, loss)
      call pair_sums_add(sums, march%system, set, motion, h)
      call pair_sums_add(sums, march%system, set, motion, 2.0_wp*h)
      associate (sum => sums%sum(1))
         call check_near(error, sum%push, 2.0_wp*h*[force, 0.0_wp], tol, 1.0_wp, "push")
         call check_near(error, sum%moment, 2.0_wp*h*[moment, 0.0_wp], tol, 10.0_wp, "by places")
         call check_near(error, [sum%impulse, sum%duration], spread(0.0_wp, 1, 4), 0.0_wp, 1.0_wp, &
            "no impulse")
         call check_near(error, pair_force(sum), [force, 0.0_wp], tol, 10.0_wp, "force")
         call check_near(error, [sum%damping, sum%friction], 2.0_wp*loss, tol, 1.0_wp, "losses")
      end associate
      call check_near(error, sums%sum(2)%span, 2.0_wp*h, tol, 1.0_wp, "the other pair's time")
      call check_true(error, .not. sums%sum(2)%is_pressed, "which nothing presses")
      call march_free(march)

   contains

      pure type(pair_sum_t) function sums_of_nothing() result(sum)
         sum%is_pressed = .true.
      end function sums_of_nothing

   end subroutine test_static_sums

   !> Forces and moments on both sides, the sides of the second pair exchanged where it is a guard
   !> of the first, the first condition one that always holds, and two nodes one place; forces at
   !> slave nodes; areas of what acts by rows.
   subroutine test_record(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: lag = 0.5_wp
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(pair_record_t) :: record
      real(wp), allocatable :: u(:, :)
      integer :: k, of_second

      do k = 1, 2
         of_second = merge(2, -1, k == 1)
         block
            type(march_t) :: fresh

            call begin(fresh, set, motion, .false., error)
            if (allocated(error)) return
            fresh%system%contact(2)%of_pair = of_second
            set%n_permanent = k - 1
            if (k == 2) call share_places(fresh%system%contact(1)%contact)
            call pair_record_init(record, fresh%system)
            call check_equal(error, pair_components(record), 3, "force and moment in the plane")
            record%force = 7.0_wp
            u = motion%u0 + motion%du
            call pair_record_measure(record, fresh%system, set, motion%x, u, motion%du, lag)
            call check_totals(error, fresh%system, set, motion, record)
            if (.not. allocated(error)) call check_forces(error, fresh%system, set, record)
            if (.not. allocated(error)) call check_areas(error, fresh%system, set, motion, record)
            call march_free(fresh)
         end block
         if (allocated(error)) return
      end do
      call begin(march, set, motion, .false., error, is_apart=.true.)
      if (allocated(error)) return
      u = motion%u0 + motion%du
      call pair_record_init(record, march%system)
      call pair_record_measure(record, march%system, set, motion%x, u, motion%du, lag)
      call check_totals(error, march%system, set, motion, record)
      if (.not. allocated(error)) call check_forces(error, march%system, set, record)
      call check_true(error, set%n > 0 .and. set%n_condition > set%n, "rows and laws, apart")
      call constraints_select(set, [integer ::])
      call pair_record_measure(record, march%system, set, motion%x, motion%u0, motion%du, lag)
      call check_near(error, record%force, 0.0_wp*record%force, 0.0_wp, 1.0_wp, "nothing acts")
      call check_near(error, [record%area, record%shear_area], &
         0.0_wp*[record%area, record%shear_area], 0.0_wp, 1.0_wp, "on no area")
      call march_free(march)
   end subroutine test_record

   !> The third node is at the place of the first, of which there are two contacts.
   subroutine share_places(contact)
      class(contact_t), intent(inout) :: contact

      contact%duplicate(1) = contact%node(3)
      contact%node(3) = contact%node(1)
      contact%duplicate(3) = contact%duplicate(1)
   end subroutine share_places

   subroutine check_totals(error, system, set, motion, record)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      type(pair_record_t), intent(in) :: record
      real(wp) :: total(6, 2, 2), push(2), place(2)
      integer :: k, i, side, pair, n_active(2)

      total = 0.0_wp
      n_active = 0
      do k = set%n_permanent + 1, set%n_condition
         associate (item => set%item(k), &
               of_pair => system%contact(contact_of(system, set%id(k)))%of_pair)
            pair = abs(of_pair)
            if (k <= set%n) n_active(pair) = n_active(pair) + 1
            do i = 1, item%n_node
               push = condition_force(item, constraints_lam(set, k), i)
               associate (n => item%node(i))
                  place = motion%x(:, n) + motion%u0(:, n) + 0.5_wp*motion%du(:, n)
               end associate
               side = merge(1, 2, i <= item%n_slave .eqv. of_pair > 0)
               total(:3, side, pair) = total(:3, side, pair) &
                  + [push, place(1)*push(2) - place(2)*push(1)]
            end do
         end associate
      end do
      do k = 1, 2
         call check_near(error, record%total(k)%slave, total(:, 1, k), tol, 10.0_wp, "slave side")
         call check_near(error, record%total(k)%master, total(:, 2, k), tol, 10.0_wp, "master side")
         call check_equal(error, record%total(k)%n_active, n_active(k), "rows")
      end do
   end subroutine check_totals

   subroutine check_forces(error, system, set, record)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(pair_record_t), intent(in) :: record
      real(wp) :: force(2, system%n_constraint)
      integer :: k, i, own

      force = 0.0_wp
      do k = set%n_permanent + 1, set%n_condition
         associate (item => set%item(k), first => system%first_constraint(contact_of(system, &
               set%id(k))), contact => system%contact(contact_of(system, set%id(k)))%contact)
            do i = 1, item%n_slave
               own = first + findloc(contact%node == item%node(i) &
                  .or. contact%duplicate == item%node(i), .true., 1)
               force(:, own) = force(:, own) + condition_force(item, constraints_lam(set, k), i)
            end do
         end associate
      end do
      call check_near(error, record%force, force, tol, 10.0_wp, "forces on nodes")
   end subroutine check_forces

   subroutine check_areas(error, system, set, motion, record)
      type(error_t), allocatable, intent(inout) :: error
      type(system_t), intent(in) :: system
      type(constraint_set_t), intent(in) :: set
      type(motion_t), intent(in) :: motion
      type(pair_record_t), intent(in) :: record
      real(wp), dimension(system%n_constraint) :: area, length, shear, by_total
      real(wp) :: total(2)
      integer :: k, i

      total = 0.0_wp
      do k = 1, size(system%contact)
         associate (first => system%first_constraint(k) + 1, last => system%first_constraint(k + 1))
            call system%contact(k)%contact%area(motion%x, motion%u0 + motion%du, area(first:last), &
               length(first:last))
            by_total(first:last) = 0.0_wp
            do i = set%n_permanent + 1, set%n
               if (set%id(i) >= first .and. set%id(i) <= last) by_total(set%id(i)) &
                  = length(set%id(i))
            end do
            total(abs(system%contact(k)%of_pair)) = total(abs(system%contact(k)%of_pair)) &
               + sum(by_total(first:last))
         end associate
      end do
      shear = area
      associate (id => set%id(set%n_permanent + 1:set%n))
         shear(id) = area(id)*set%item(set%n_permanent + 1:set%n)%normal
      end associate
      call check_near(error, record%area, area, tol, 1.0_wp, "areas")
      call check_near(error, record%shear_area, shear, tol, 1.0_wp, "areas of friction")
      call check_near(error, record%total%covered, total, tol, 1.0_wp, "lengths")
   end subroutine check_areas

   !> A jump of each pair, of a slave node, the first one at the place of another, and two master
   !> nodes.
   subroutine test_jumps(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(pair_record_t) :: record
      type(pair_sums_t) :: sums
      type(velocity_jump_t) :: jump(2)
      real(wp) :: total(3, 2), nodal(2, 16), push(2)
      integer :: k, i, own

      call begin(march, set, motion, .false., error)
      if (allocated(error)) return
      associate (system => march%system)
         system%contact(2)%of_pair = -1
         associate (contact => system%contact(1)%contact)
            own = findloc(contact%node, 12, 1)
            contact%duplicate(own) = 12
            contact%node(own) = 16
         end associate
         jump(1) = velocity_jump_t(2, 1, [12, 7, 8], reshape([1.0_wp, 4.0_wp, -0.25_wp, -2.5_wp, &
            -0.75_wp, -1.5_wp], [2, 3]), 4.0_wp, [0.5_wp], [0.125_wp])
         jump(2) = velocity_jump_t(system%first_constraint(2) + 1, 1, [ &
            system%contact(2)%contact%node(1), 11, 12], reshape([0.5_wp, -2.0_wp, 0.25_wp, 1.5_wp, &
            -0.75_wp, 0.5_wp], [2, 3]), 3.0_wp, [0.25_wp], [2.0_wp])
         call pair_record_init(record, system)
         call pair_record_jump(record, system, jump, motion%x, h)
         total = reshape([0.5_wp + 2.0_wp, 0.0_wp, 0.0_wp, 0.125_wp + 0.25_wp, 0.0_wp, 0.0_wp], &
            [3, 2])/h
         total = cshift(total, 1, 1)
         nodal = 0.0_wp
         do k = 1, 2
            do i = 1, 3
               associate (node => jump(k)%node(i), side => merge(1, 2, i == 1 .eqv. k == 1))
                  push = jump(k)%impulse(:, i)/h
                  nodal(:, node) = nodal(:, node) + push
                  total(:, side) = total(:, side) + [push, motion%x(1, node)*push(2) &
                     - motion%x(2, node)*push(1)]
               end associate
            end do
         end do
         call check_near(error, record%total(1)%slave(:3), total(:, 1), tol, 100.0_wp, "slave side")
         call check_near(error, record%total(1)%master(:3), total(:, 2), tol, 100.0_wp, &
            "master side")
         call check_near(error, record%jump, nodal, tol, 100.0_wp, "on nodes")
         call check_near(error, record%jump_lam([2, jump(2)%id]), [4.0_wp, 3.0_wp]/h, tol, &
            100.0_wp, "multipliers")
         call check_near(error, sum(abs(record%jump_lam)), 7.0_wp/h, tol, 100.0_wp, "and no others")
         call check_near(error, record%force(:, own), jump(1)%impulse(:, 1)/h, tol, &
            100.0_wp, "on a slave node")
         call check_near(error, record%force(:, jump(2)%id), jump(2)%impulse(:, 1)/h, tol, &
            100.0_wp, "on one of the other contact")
         call check_near(error, sum(abs(record%force)), 7.5_wp/h, tol, 100.0_wp, "and no others")
         allocate(sums%sum(1))
         sums%of_pair = [1, -1]
         call pair_sums_jump(sums, system, jump)
         push = jump(1)%impulse(:, 1) - jump(2)%impulse(:, 1)
         call check_near(error, [sums%sum(1)%push, sums%sum(1)%impulse], [push, 0.0_wp, push, &
            0.0_wp], tol, 10.0_wp, "sums")
         call pair_record_jump(record, system, jump(:0), motion%x, h)
         call check_true(error, .not. allocated(record%jump), "no jumps in the next step")
      end associate
      call march_free(march)
   end subroutine test_jumps

   !> Gaps by the edge, weighted by impulses; what is closed counts as 0, round-off as no force.
   subroutine test_stand_off(error)
      type(error_t), allocatable, intent(out) :: error
      type(march_t) :: march
      type(constraint_set_t) :: set
      type(motion_t) :: motion
      type(stand_off_t) :: stand_off
      real(wp), allocatable :: gap(:), force(:)
      integer :: i, k, step

      call begin(march, set, motion, .false., error)
      if (allocated(error)) return
      call check_near(error, stand_off_mean(stand_off), 0.0_wp, 0.0_wp, 1.0_wp, "no force yet")
      allocate(gap(set%n), force(set%n))
      set%lam(1) = -set%lam(1)
      do i = 1, set%n
         k = contact_of(march%system, set%id(i))
         associate (state => march%system%contact(k)%contact%state(set%id(i) &
               - march%system%first_constraint(k)), item => set%item(i))
            state%gap1 = 0.1_wp*real(mod(i, 3), wp) - 0.05_wp
            if (mod(i, 2) == 0) state%other_size = 0.25_wp*state%size
            gap(i) = max(0.0_wp, state%gap1)/min(state%size, state%other_size)
            force(i) = abs(set%lam(i))*norm2(sum(item%g(:, :item%n_slave), 2))
         end associate
      end do
      set%lam(set%n) = sqrt(epsilon(1.0_wp))*1.0e-3_wp*set%lam(set%n)
      force(set%n) = 0.0_wp
      do step = 1, 2
         call stand_off_add(stand_off, march%system, set, real(step, wp)*h)
      end do
      call check_true(error, sum(force*gap) > 0.0_wp, "air")
      call check_near(error, stand_off%largest, maxval(gap, mask=force > 0.0_wp), tol, 1.0_wp, &
         "largest")
      call check_near(error, stand_off%impulse, 3.0_wp*h*sum(force), tol, 10.0_wp, "impulse")
      call check_near(error, stand_off_mean(stand_off), sum(force*gap)/sum(force), tol, 1.0_wp, &
         "mean")
      call march_free(march)
   end subroutine test_stand_off

end module test_pair_forces
