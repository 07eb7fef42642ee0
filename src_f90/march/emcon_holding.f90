!> Bodies that contact alone holds in a static step: which contacts to take in, and what they leave.
!>
!> Before forces can be balanced every rigid motion must be prevented. While supports, ties and the
!> active contacts leave one, the bodies follow their loads along it until the next contact
!> touches, which is taken in; along a motion that no load works on the nearest contact is. The
!> active set lets go of what turns out to pull. Source: docs/theory.md, section 6.
module emcon_holding
   use emcon_constraints, only : constraint_place, constraint_set_t, constraints_evaluate, &
      constraints_select
   use emcon_first_touch, only : touch_time
   use emcon_kinds, only : dp, wp
   use emcon_loads, only : loads_add
   use emcon_numbering, only : add_to_dofs
   use emcon_rigid_bodies, only : find_assemblies, find_free_motions, rigid_bodies_find, &
      rigid_bodies_t, rigid_field, rigid_force, rigid_rows_append, rigid_rows_find, rigid_rows_t
   use emcon_rigid_motion, only : describe_motion
   use emcon_scene, only : scene_t
   use emcon_system, only : pose_t, system_stiffen, system_t
   implicit none
   private
   public :: holding_t, holding_begin, holding_complete, holding_find_free

   !> Contacts that close at the same time, by this fraction of an edge, are taken in together.
   real(wp), parameter :: together = 1.0e-3_wp
   !> A contact that closes by less than this, per unit of a motion, is not in its way.
   real(wp), parameter :: in_the_way = sqrt(epsilon(1.0_wp))
   !> Bodies turn by less than this at once, in radians: then gaps are measured anew.
   real(wp), parameter :: largest_turn = 0.1_wp

   type :: holding_t
      logical :: is_needed = .false.             !! contact alone holds some body
      real(wp) :: tolerance = 0.0_wp             !! loads below this part of all are none
      type(rigid_rows_t) :: supports             !! prescribed freedoms, ties and equations
      logical, allocatable :: is_loose(:)        !! (n_body) it has a motion that nothing holds
      character(len=:), allocatable :: text      !! what nothing holds; not allocated: all is held
   end type holding_t

   !> The bodies and contacts of one look at the scene.
   type :: look_t
      type(rigid_bodies_t) :: bodies
      type(rigid_rows_t) :: rows
      integer, allocatable :: assembly(:), order(:)
      integer :: n_assembly = 0
   end type look_t

   !> An assembly of bodies and the motions that are left of it.
   type :: free_t
      integer, allocatable :: member(:)
      real(dp), allocatable :: z(:, :)           !! (3*members, n) orthonormal columns
      real(dp) :: noise = 0.0_dp
   end type free_t

contains

   !> Find out whether contact alone holds some body in step `system%i_step`, which is static.
   subroutine holding_begin(self, system, scene, u)
      type(holding_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)            !! (2, n_node)
      type(look_t) :: look
      type(free_t), allocatable :: free(:)

      associate (step => scene%step(system%i_step))
         self%tolerance = step%newton_tolerance
         call rigid_rows_find(system, step%prescribed, self%supports)
      end associate
      allocate(self%is_loose(system%n_body), source=.false.)
      if (size(system%contact) == 0) return
      call take_look(self, system, scene, u, look)
      call find_free(look, free)
      self%is_needed = size(free) > 0
   end subroutine holding_begin

   !> Take contacts into `is_active`, and move bodies in `du`, until contact holds all that it can.
   !> `is_held` is false if a load works on a motion with nothing in its way.
   subroutine holding_complete(self, system, scene, pose, u0, du, is_active, is_held)
      type(holding_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      real(wp), intent(in), contiguous :: u0(:, :)       !! (2, n_node)
      real(wp), intent(inout), contiguous :: du(:, :)    !! (2, n_node)
      logical, intent(inout) :: is_active(:)             !! (n_constraint)
      logical, intent(out) :: is_held
      type(look_t) :: look
      type(free_t), allocatable :: free(:)
      logical :: has_changed, is_pushed
      integer :: i, round

      is_held = .true.
      self%is_loose = .false.
      if (allocated(self%text)) deallocate(self%text)
      do round = 1, 6*system%n_body + size(is_active)
         call measure(system, scene, u0, du)
         call look_at_contacts(self, system, scene, pose, u0, du, is_active, look)
         call find_free(look, free)
         if (size(free) == 0) exit
         has_changed = .false.
         do i = 1, size(free)
            call follow_load(self, system, scene, pose, look%bodies, free(i), u0, du, is_active, &
               has_changed, is_pushed)
            if (is_pushed) then
               is_held = .false.
               call tell(self, system, scene, look%bodies, free(i))
               return
            end if
            if (has_changed) exit
         end do
         if (.not. has_changed) exit
      end do
      do i = 1, size(free)
         self%is_loose(pack(free(i)%member, free(i)%member <= system%n_body)) = .true.
      end do
      call system_stiffen(system, self%is_loose)
   end subroutine holding_complete

   !> Whether supports and the contacts `is_active` leave a motion at the end of the step.
   subroutine holding_find_free(self, system, scene, pose, u0, du, is_active)
      type(holding_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)     !! (2, n_node)
      logical, intent(in) :: is_active(:)                        !! (n_constraint)
      type(look_t) :: look
      type(free_t), allocatable :: free(:)

      if (allocated(self%text)) deallocate(self%text)
      call look_at_contacts(self, system, scene, pose, u0, du, is_active, look)
      call find_free(look, free)
      if (size(free) > 0) call tell(self, system, scene, look%bodies, free(1))
   end subroutine holding_find_free

   subroutine tell(self, system, scene, bodies, free)
      type(holding_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(rigid_bodies_t), intent(in) :: bodies
      type(free_t), intent(inout) :: free

      call describe_motion(bodies, system, scene, free%noise, free%member, free%z, self%text)
   end subroutine tell

   !> Gaps for the motion `du`, of the stencils that it calls for.
   subroutine measure(system, scene, u0, du)
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      integer :: pair

      do pair = 1, size(system%contact)
         call system%contact(pair)%contact%begin_step(scene%x, u0, du)
         call system%contact(pair)%contact%measure(scene%x, u0, du)
      end do
   end subroutine measure

   !> Bodies at x + u with their supports.
   subroutine take_look(self, system, scene, u, look)
      type(holding_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)            !! (2, n_node)
      type(look_t), intent(out) :: look

      look%rows = self%supports
      if (system%nlgeom) then
         call rigid_bodies_find(system, scene, scene%x + u, look%rows, .false., .true., look%bodies)
      else
         call rigid_bodies_find(system, scene, scene%x, look%rows, .false., .true., look%bodies)
      end if
   end subroutine take_look

   !> The same with the contacts `is_active`; gaps have been measured.
   subroutine look_at_contacts(self, system, scene, pose, u0, du, is_active, look)
      type(holding_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: is_active(:)
      type(look_t), intent(out) :: look
      type(constraint_set_t) :: set

      call take_look(self, system, scene, u0 + du, look)
      call evaluate(system, scene, pose, u0, du, is_active, set)
      call rigid_rows_append(look%rows, set%item)
   end subroutine look_at_contacts

   !> The contacts that `is_meant` marks, as they are at u0 + du.
   subroutine evaluate(system, scene, pose, u0, du, is_meant, set)
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      real(wp), intent(in), contiguous :: u0(:, :), du(:, :)
      logical, intent(in) :: is_meant(:)         !! (n_constraint)
      type(constraint_set_t), intent(out) :: set
      integer :: k, pair, i, id

      call constraints_select(set, pack([(k, k = 1, size(is_meant))], &
         is_meant .and. [(k > system%linear%n, k = 1, size(is_meant))]))
      do k = 1, set%n
         id = set%id(k)
         call constraint_place(system, id, pair, i)
         set%target(k) = system%contact(pair)%contact%state(i)%gap1
      end do
      call constraints_evaluate(set, system, scene, pose, u0, du)
   end subroutine evaluate

   !> The assemblies that can move.
   subroutine find_free(look, free)
      type(look_t), intent(inout) :: look
      type(free_t), allocatable, intent(out) :: free(:)
      type(free_t) :: found
      integer :: i, n, first, last

      call find_assemblies(look%bodies, look%rows, look%assembly, look%n_assembly, look%order)
      allocate(free(0))
      last = 0
      do i = 1, look%n_assembly
         first = last + 1
         do while (last < size(look%order))
            if (look%assembly(look%rows%low(look%order(last + 1))) /= i) exit
            last = last + 1
         end do
         found%member = pack([(n, n = 1, look%bodies%n)], look%assembly == i)
         call find_free_motions(look%bodies, look%rows, look%order(first:last), found%member, &
            found%z, found%noise)
         if (size(found%z, 2) > 0) free = [free, found]
      end do
   end subroutine find_free

   !> Let an assembly follow its load to the next contact and take that in, or without a load take
   !> in the nearest one. `is_pushed`: there is a load, and nothing in its way.
   subroutine follow_load(self, system, scene, pose, bodies, free, u0, du, is_active, has_changed, &
      is_pushed)
      type(holding_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      type(rigid_bodies_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      real(wp), intent(in), contiguous :: u0(:, :)
      real(wp), intent(inout), contiguous :: du(:, :)
      logical, intent(inout) :: is_active(:)
      logical, intent(inout) :: has_changed
      logical, intent(out) :: is_pushed
      type(constraint_set_t) :: set
      real(wp) :: way(2, size(du, 2)), time, turn
      real(dp) :: along(size(free%z, 2))
      logical :: is_candidate(size(is_active)), is_next(size(is_active))

      call find_load(self, system, scene, pose, bodies, free, u0 + du, along)
      is_candidate = candidates(system) .and. .not. is_active
      call evaluate(system, scene, pose, u0, du, is_candidate, set)
      is_pushed = norm2(along) > 0.0_dp
      if (is_pushed) then
         call rigid_field(bodies, free%member, matmul(free%z, along/norm2(along)), way)
         call next_to_close(set, way, time, is_next)
         if (.not. any(is_next)) then
            time = touch_time(scene, bodies%x, way)
            if (.not. time < huge(time)) return
            ! Touching, but past the end of the surface that would hold it.
            if (time*maxval(abs(way)) <= in_the_way*maxval(bodies%size(free%member))) return
         end if
         is_pushed = .false.
         turn = real(maxval(abs(matmul(free%z(3::3, :), along/norm2(along)) &
            /max(real(bodies%size(free%member), dp), tiny(1.0_dp)))), wp)
         if (time*turn > largest_turn) then
            time = largest_turn/turn
            is_next = .false.
         end if
         call move(system, way, time, du)
      else
         call nearest(set, bodies, free, is_next)
      end if
      has_changed = norm2(along) > 0.0_dp .or. any(is_next)
      is_active = is_active .or. is_next
   end subroutine follow_load

   !> The load along each free motion; 0 if it is nothing against all loads on these bodies.
   subroutine find_load(self, system, scene, pose, bodies, free, u, along)
      type(holding_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(pose_t), intent(in) :: pose
      type(rigid_bodies_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      real(wp), intent(in), contiguous :: u(:, :)        !! (2, n_node)
      real(dp), intent(out) :: along(:)                  !! (free motions)
      real(dp) :: total(3*size(free%member)), magnitude

      system%f_work = 0.0_wp
      call loads_add(system%loads, scene, system%solid, pose%load_instant, u, system%f_work)
      call rigid_force(bodies, free%member, system%f_work, total, magnitude)
      along = matmul(total, free%z)
      if (norm2(along) <= max(real(self%tolerance, dp), free%noise)*magnitude) along = 0.0_dp
   end subroutine find_load

   !> Contacts that can act at the end of the motion that was measured.
   pure function candidates(system) result(is_meant)
      type(system_t), intent(in) :: system
      logical :: is_meant(system%n_constraint)
      integer :: pair

      is_meant = .false.
      do pair = 1, size(system%contact)
         associate (contact => system%contact(pair)%contact, &
               first => system%first_constraint(pair) + 1, &
               last => system%first_constraint(pair + 1))
            is_meant(first:last) = contact%state%is_near .and. contact%state%is_over &
               .and. .not. contact%state%is_leaving
            is_meant(first:last) = is_meant(first:last) .and. &
               contact%state%gap1 > -contact%deepest_start*contact%state%size
         end associate
      end do
   end function candidates

   !> Of the contacts `set` those that close first on a way, and when; huge if none does.
   pure subroutine next_to_close(set, way, time, is_next)
      type(constraint_set_t), intent(in) :: set
      real(wp), intent(in) :: way(:, :)          !! (2, n_node) per time
      real(wp), intent(out) :: time
      logical, intent(out) :: is_next(:)         !! (n_constraint)
      real(wp) :: rate(set%n), gap(set%n)
      integer :: k, i

      time = huge(time)
      is_next = .false.
      do k = 1, set%n
         associate (item => set%item(k))
            rate(k) = 0.0_wp
            do i = 1, item%n_node
               rate(k) = rate(k) - dot_product(item%c(:, i), way(:, item%node(i)))
            end do
            gap(k) = max(0.0_wp, set%target(k))
            if (rate(k) <= in_the_way*sum(abs(item%c(:, :item%n_node)))) rate(k) = 0.0_wp
            if (rate(k) > 0.0_wp) time = min(time, gap(k)/rate(k))
         end associate
      end do
      do k = 1, set%n
         if (rate(k) > 0.0_wp) is_next(set%id(k)) = &
            gap(k) - time*rate(k) <= together*set%item(k)%size
      end do
   end subroutine next_to_close

   !> Of the contacts `set` those with the smallest gap that prevent a motion that is left.
   pure subroutine nearest(set, bodies, free, is_next)
      type(constraint_set_t), intent(in) :: set
      type(rigid_bodies_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      logical, intent(out) :: is_next(:)         !! (n_constraint)
      real(wp) :: way(2, size(bodies%of_node)), rate(set%n), smallest
      integer :: j, k, i

      rate = 0.0_wp
      do j = 1, size(free%z, 2)
         call rigid_field(bodies, free%member, free%z(:, j), way)
         do k = 1, set%n
            associate (item => set%item(k))
               rate(k) = max(rate(k), abs(sum([(dot_product(item%c(:, i), &
                  way(:, item%node(i))), i = 1, item%n_node)]))/sum(abs(item%c(:, :item%n_node))))
            end associate
         end do
      end do
      is_next = .false.
      if (.not. any(rate > in_the_way)) return
      smallest = minval(set%target, mask=rate > in_the_way)
      do k = 1, set%n
         is_next(set%id(k)) = rate(k) > in_the_way .and. &
            set%target(k) - smallest <= together*set%item(k)%size
      end do
   end subroutine nearest

   !> Move the unknown freedoms on, and those that follow from them.
   subroutine move(system, way, time, du)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: way(:, :)                  !! (2, n_node)
      real(wp), intent(in) :: time
      real(wp), intent(inout), contiguous :: du(:, :)
      real(wp) :: vector(system%numbering%n_unknown)
      integer :: k

      do k = 1, size(vector)
         associate (dof => system%numbering%dof(k))
            vector(k) = way(2 - mod(dof, 2), (dof + 1)/2)
         end associate
      end do
      call add_to_dofs(system%numbering, vector, time, du)
   end subroutine move

end module emcon_holding
