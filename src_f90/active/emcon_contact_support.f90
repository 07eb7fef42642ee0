!> Bodies that contact alone holds in a static step: which contacts to take in, and what they leave.
!>
!> Before forces can be balanced every rigid motion must be prevented. While supports, ties and the
!> active contacts leave one, the bodies follow their loads along it until the next contact
!> touches, which is taken in; along a motion that no load works on the nearest contact is, unless
!> it has pulled. The active set lets go of what turns out to pull. What is left at the end is
!> told; with STABILIZE a motion that no load works on may be. Source: docs/theory.md, section 6.2.
module emcon_contact_support
   use emcon_constraint, only : condition_rate
   use emcon_constraints, only : constraint_set_t
   use emcon_first_touch, only : touch_time
   use emcon_free_motions, only : find_assemblies, find_free_motions
   use emcon_contact_support_gaps, only : gaps_evaluate, gaps_keep_closed, gaps_measure, &
      gaps_nearest, gaps_next_guards, gaps_next_to_close, gaps_of_guards, gaps_that_can_act, &
      gaps_that_leave, in_the_way
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_evaluate, motion_t
   use emcon_numbering, only : add_to_dofs
   use emcon_mechanisms, only : held_places, mechanisms_find, mechanisms_t, mechanism_field, &
      mechanism_force, mechanism_places
   use emcon_mechanism_text, only : describe_motion
   use emcon_mechanism_rows, only : mechanism_rows_append, mechanism_rows_find, mechanism_rows_t
   use emcon_scene, only : scene_t
   use emcon_system, only : system_loads, system_springs, system_stiffen, system_t
   implicit none
   private
   public :: contact_support_t, contact_support_begin, contact_support_forget, &
      contact_support_complete, contact_support_find_jam, contact_support_find_free

   !> Bodies turn by less than this at once, in radians: then gaps are measured anew.
   real(wp), parameter :: largest_turn = 0.1_wp

   type :: contact_support_t
      logical :: is_needed = .false.             !! contact alone holds some body
      logical :: stabilizes = .false.            !! what no load works on needs not be held
      real(wp) :: tolerance = 0.0_wp             !! loads below this part of all are none
      type(mechanism_rows_t) :: supports             !! prescribed freedoms, ties and equations
      logical, allocatable :: is_loose(:)        !! (n_body) it has a motion that nothing holds
      logical, allocatable :: hangs(:)           !! (n_body) supports alone leave it one
      logical :: is_pushed = .false.             !! a load works on what `text` tells of
      character(len=:), allocatable :: text      !! what nothing holds; not allocated: all is held
      character(len=:), allocatable :: told      !! whose motion the user has been told of
      !> (n_constraint) contacts that hold along the surface as well, by friction
      logical, allocatable :: grips(:)
      !> (n_dim - 1, n_constraint) of length 1: of what grips, along which it slides all the same
      real(wp), allocatable :: way(:, :)
      !> (n_constraint) [L] gaps that were closed though no load closes them, and of which bodies
      real(wp), allocatable :: brought(:)
      !> (n_constraint) gaps at the start of the step that it resolves, <= 0 [L]
      real(wp), allocatable :: overclosure(:)
      character(len=:), allocatable :: brought_text
   end type contact_support_t

   !> The bodies and contacts of one look at the scene.
   type :: overlap_query_t
      type(mechanisms_t) :: bodies
      type(mechanism_rows_t) :: rows
      integer, allocatable :: assembly(:), order(:)
      integer :: n_assembly = 0
   end type overlap_query_t

   !> An assembly of bodies and the motions that are left of it.
   type :: free_t
      integer, allocatable :: member(:)
      real(dp), allocatable :: z(:, :)           !! (n_motion*members, n) orthonormal
      real(dp) :: noise = 0.0_dp
      real(dp), allocatable :: along(:)          !! (n) load along each of them
      logical :: is_loaded = .false.             !! some load acts on these bodies
   end type free_t

contains

   !> Find out whether contact alone holds some body in step `system%i_step`, which is static.
   subroutine contact_support_begin(self, system, scene, u)
      type(contact_support_t), intent(out) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node)
      type(overlap_query_t) :: look
      type(free_t), allocatable :: free(:)
      integer :: i

      associate (step => scene%step(system%i_step))
         self%tolerance = step%solution%newton_tolerance
         self%stabilizes = step%stabilizes
         call mechanism_rows_find(system, step%prescribed, self%supports)
      end associate
      allocate(self%is_loose(system%space%n_body), self%hangs(system%space%n_body), source=.false.)
      allocate(self%grips, source=system_springs(system))
      allocate(self%way(size(u, 1) - 1, system%n_constraint), source=0.0_wp)
      allocate(self%brought(system%n_constraint), self%overclosure(system%n_constraint), &
         source=0.0_wp)
      if (size(system%contact) == 0) return
      call take_look(self, system, scene, u, look)
      call find_free(look, free)
      self%is_needed = size(free) > 0
      do i = 1, size(free)
         self%hangs(pack(free(i)%member, free(i)%member <= system%space%n_body)) = .true.
      end do
   end subroutine contact_support_begin

   !> Forget what an attempt at a step has found.
   pure subroutine contact_support_forget(self)
      type(contact_support_t), intent(inout) :: self

      if (.not. self%is_needed) return
      self%brought = 0.0_wp
   end subroutine contact_support_forget

   !> Take contacts into `is_active`, and move bodies in `motion`, until contact holds all that it
   !> can.
   !> `self%text` tells of a motion that a load works on with nothing in its way.
   subroutine contact_support_complete(self, system, scene, motion, is_active)
      type(contact_support_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(inout) :: motion
      logical, intent(inout) :: is_active(:)             !! (n_constraint)
      type(overlap_query_t) :: look
      type(free_t), allocatable :: free(:)
      logical :: has_changed
      integer :: i, round, n_active

      self%is_loose = .false.
      if (allocated(self%text)) deallocate(self%text)
      do round = 1, 6*system%space%n_body + size(is_active)
         call motion_evaluate(motion)
         call gaps_measure(system, motion)
         is_active = is_active .and. .not. gaps_that_leave(system)
         call look_at_contacts(self, system, scene, motion, is_active, look)
         call find_free(look, free)
         if (size(free) == 0) exit
         has_changed = .false.
         do i = 1, size(free)
            call find_load(self, system, motion, look%bodies, free(i))
            if (.not. norm2(free(i)%along) > 0.0_dp) cycle
            call follow_load(self, system, scene, motion, look%bodies, free(i), is_active)
            if (self%is_pushed) call tell(look%bodies, system, scene, free(i), self%text)
            if (self%is_pushed) return
            has_changed = .true.
            exit
         end do
         n_active = count(is_active)
         do i = 1, size(free)
            if (has_changed) exit
            call take_nearest(self, system, scene, motion, look%bodies, free(i), is_active)
            has_changed = count(is_active) > n_active
         end do
         if (.not. has_changed) exit
      end do
      do i = 1, size(free)
         self%is_loose(pack(free(i)%member, free(i)%member <= system%space%n_body)) = .true.
      end do
      call system_stiffen(system, self%is_loose, motion)
   end subroutine contact_support_complete

   !> Whether supports and the contacts `is_active` leave a motion at the end of the step; `is_held`
   !> unless it is one that must be.
   subroutine contact_support_find_free(self, system, scene, motion, is_active, is_held)
      type(contact_support_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion                       !! placed
      logical, intent(in) :: is_active(:)                        !! (n_constraint)
      logical, intent(out) :: is_held            !! no motion is free, or one that may stay
      type(overlap_query_t) :: look
      type(free_t), allocatable :: free(:)
      integer :: i, k

      if (allocated(self%text)) deallocate(self%text)
      self%is_pushed = .false.
      call look_at_contacts(self, system, scene, motion, is_active, look)
      call find_free(look, free)
      k = min(1, size(free))
      do i = 1, size(free)
         call find_load(self, system, motion, look%bodies, free(i))
         if (self%is_pushed .or. .not. norm2(free(i)%along) > 0.0_dp) cycle
         self%is_pushed = .true.
         k = i
      end do
      if (k > 0) call tell(look%bodies, system, scene, free(k), self%text)
      is_held = k == 0 .or. (self%stabilizes .and. .not. self%is_pushed)
   end subroutine contact_support_find_free

   !> Does friction that has let go drive a body that is left to its load? Then it jams: a body that
   !> slides is braked by all of it.
   subroutine contact_support_find_jam(self, system, scene, motion, is_active, friction, jams)
      type(contact_support_t), intent(inout) :: self     !! with the grips that are left
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion                       !! placed
      logical, intent(in) :: is_active(:)                        !! (n_constraint)
      real(wp), intent(in) :: friction(:, :)     !! (n_slip, n_constraint) of what let go, else 0
      logical, intent(out) :: jams               !! some of it drives
      type(overlap_query_t) :: look
      type(free_t), allocatable :: free(:)
      type(constraint_set_t) :: set
      real(wp) :: direction(size(motion%du, 1), size(motion%du, 2)), rate(size(friction, 1))
      logical :: has_let_go(size(is_active))
      integer :: i, k, s

      has_let_go = any(abs(friction) > 0.0_wp, 1)
      call look_at_contacts(self, system, scene, motion, is_active, look)
      call find_free(look, free)
      call gaps_evaluate(system, motion, has_let_go, set, has_let_go)
      jams = .false.
      do i = 1, size(free)
         call find_load(self, system, motion, look%bodies, free(i))
         if (.not. norm2(free(i)%along) > 0.0_dp) cycle
         call mechanism_field(look%bodies, free(i)%member, &
            matmul(free(i)%z, free(i)%along/norm2(free(i)%along)), direction)
         do k = 1, set%n
            rate = [(condition_rate(set%item(k), direction, s), s = 1, size(rate))]
            associate (push => friction(:, set%id(k)))
               jams = jams .or. dot_product(push, rate) > in_the_way*norm2(push)*norm2(rate)
            end associate
         end do
      end do
   end subroutine contact_support_find_jam

   !> The bodies of an assembly that move, and how.
   subroutine tell(bodies, system, scene, free, text)
      type(mechanisms_t), intent(in) :: bodies
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(free_t), intent(in) :: free
      character(len=:), allocatable, intent(out) :: text
      type(free_t) :: named

      named = free
      call describe_motion(bodies, system, scene, named%noise, named%member, named%z, text)
   end subroutine tell

   !> Bodies at x + u with their supports.
   subroutine take_look(self, system, scene, u, look)
      type(contact_support_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: u(:, :)            !! (n_dim, n_node)
      type(overlap_query_t), intent(out) :: look

      look%rows = self%supports
      call mechanisms_find(system, scene, held_places(system, scene, u), look%rows, .false., &
         .true., look%bodies)
   end subroutine take_look

   !> The same with the contacts `is_active`; gaps have been measured.
   subroutine look_at_contacts(self, system, scene, motion, is_active, look)
      type(contact_support_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: is_active(:)
      type(overlap_query_t), intent(out) :: look
      type(constraint_set_t) :: set

      call take_look(self, system, scene, motion%u0 + motion%du, look)
      call gaps_evaluate(system, motion, is_active, set, self%grips)
      call mechanism_rows_append(look%rows, set%item, set%item%has_friction, self%way(:, set%id))
   end subroutine look_at_contacts

   !> The assemblies that can move.
   subroutine find_free(look, free)
      type(overlap_query_t), intent(inout) :: look
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

   !> Let an assembly follow its load to the next contact and take that in. `self%is_pushed`: there
   !> is nothing in its way.
   subroutine follow_load(self, system, scene, motion, bodies, free, is_active)
      type(contact_support_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(inout) :: motion
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      logical, intent(inout) :: is_active(:)
      type(constraint_set_t) :: set
      real(wp) :: direction(size(motion%du, 1), size(motion%du, 2)), time, turn
      real(dp) :: rigid(bodies%n_motion*size(free%member)), share(size(free%along))
      logical :: is_next(size(is_active))

      share = free%along/norm2(free%along)
      rigid = matmul(free%z, share)
      call mechanism_field(bodies, free%member, rigid, direction)
      associate (may => gaps_that_can_act(system, self%overclosure) .and. .not. is_active)
         call gaps_evaluate(system, motion, may .and. .not. gaps_of_guards(system), set)
         call gaps_next_to_close(set, direction, time, is_next)
         turn = turn_of(bodies, free, rigid)
         ! A tip is stopped by its guard before what lies around it meets in the mean; where nothing
         ! that pairs hold is in the way guards hold a body that tips.
         if (any(is_next) .or. turn*maxval(bodies%size(free%member)) &
            > in_the_way*maxval(abs(direction))) then
            call gaps_evaluate(system, motion, may .and. gaps_of_guards(system), set)
            call gaps_next_guards(set, direction, time, is_next)
         end if
      end associate
      self%is_pushed = .not. any(is_next)
      if (self%is_pushed) then
         time = touch_time(scene, system%i_step, bodies%x, direction)
         if (.not. time < huge(time)) return
         ! Touching, but past the end of the surface that would hold it.
         if (time*maxval(abs(direction)) <= in_the_way*maxval(bodies%size(free%member))) return
      end if
      self%is_pushed = .false.
      if (time*turn > largest_turn) then
         time = largest_turn/turn
         is_next = .false.
      end if
      call move(system, direction, time, motion%du)
      is_active = is_active .or. is_next
   end subroutine follow_load

   !> Along motions that no load works on take in the contacts that touch already; where no load
   !> acts on the bodies at all, those with the smallest gap.
   subroutine take_nearest(self, system, scene, motion, bodies, free, is_active)
      type(contact_support_t), intent(inout) :: self
      type(system_t), intent(inout) :: system
      type(scene_t), intent(in) :: scene
      type(motion_t), intent(inout) :: motion
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      logical, intent(inout) :: is_active(:)
      type(constraint_set_t) :: set
      logical :: is_next(size(is_active))

      call gaps_evaluate(system, motion, gaps_that_can_act(system, self%overclosure) &
         .and. .not. (is_active .or. gaps_of_guards(system)), set)
      call gaps_nearest(set, bodies, free%member, free%z, is_next)
      if (free%is_loaded) call gaps_keep_closed(set, is_next)
      if (.not. any(is_next)) return
      call note_brought(self, system, scene, bodies, free, set, is_next)
      call bring(system, bodies, free, set, is_next, motion%du)
      is_active = is_active .or. is_next
   end subroutine take_nearest

   !> Move the bodies of an assembly along what is left of their motions, until the nearest of the
   !> contacts that are taken in touches.
   subroutine bring(system, bodies, free, set, is_next, du)
      type(system_t), intent(in) :: system
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_next(:)          !! (n_constraint)
      real(wp), intent(inout), contiguous :: du(:, :)
      real(wp) :: direction(size(du, 1), size(du, 2)), rate(size(free%z, 2)), time
      real(dp) :: rigid(bodies%n_motion*size(free%member))
      integer :: j, k

      k = minloc(set%target(:set%n), 1, is_next(set%id(:set%n)))
      if (.not. set%target(k) > in_the_way*set%item(k)%size) return
      do j = 1, size(rate)
         call mechanism_field(bodies, free%member, free%z(:, j), direction)
         rate(j) = condition_rate(set%item(k), direction)
      end do
      rigid = matmul(free%z, real(rate, dp))
      time = set%target(k)/sum(rate**2)
      ! What is near the center of a turn is for Newton's method to close.
      if (time*turn_of(bodies, free, rigid) > largest_turn) return
      call mechanism_field(bodies, free%member, rigid, direction)
      call move(system, direction, -time, du)
   end subroutine bring

   !> The largest angle by which bodies of an assembly turn in a motion, per unit of it.
   pure real(wp) function turn_of(bodies, free, rigid) result(turn)
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      real(dp), intent(in) :: rigid(:)           !! (n_motion*members)
      integer :: place(bodies%n_motion), i

      turn = 0.0_wp
      do i = 1, size(free%member)
         place = mechanism_places(bodies, i)
         associate (size => bodies%size(free%member(i)))
            if (size > 0.0_wp) turn = max(turn, &
               real(maxval(abs(rigid(place(bodies%n_dim + 1:)))), wp)/size)
         end associate
      end do
   end function turn_of

   !> Remember contacts that are closed over a gap with no load to close it.
   subroutine note_brought(self, system, scene, bodies, free, set, is_next)
      type(contact_support_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(in) :: free
      type(constraint_set_t), intent(in) :: set
      logical, intent(in) :: is_next(:)          !! (n_constraint)
      integer :: k

      do k = 1, set%n
         if (.not. is_next(set%id(k))) cycle
         if (set%target(k) <= in_the_way*set%item(k)%size) cycle
         self%brought(set%id(k)) = set%target(k)
         call tell(bodies, system, scene, free, self%brought_text)
      end do
   end subroutine note_brought

   !> The load along each free motion; 0 if it is nothing against all loads on these bodies.
   subroutine find_load(self, system, motion, bodies, free)
      type(contact_support_t), intent(in) :: self
      type(system_t), intent(inout) :: system
      type(motion_t), intent(in) :: motion
      type(mechanisms_t), intent(in) :: bodies
      type(free_t), intent(inout) :: free
      real(dp) :: total(bodies%n_motion*size(free%member)), along(size(free%z, 2)), magnitude
      real(wp) :: force(size(motion%x, 1), size(motion%x, 2))

      call system_loads(system, motion, force)
      call mechanism_force(bodies, free%member, force, total, magnitude)
      along = matmul(total, free%z)
      free%is_loaded = magnitude > 0.0_dp
      if (norm2(along) <= max(real(self%tolerance, dp), free%noise)*magnitude) along = 0.0_dp
      free%along = along
   end subroutine find_load

   !> Move the unknown freedoms on, and those that follow from them.
   subroutine move(system, direction, time, du)
      type(system_t), intent(in) :: system
      real(wp), intent(in) :: direction(:, :)            !! (n_dim, n_node)
      real(wp), intent(in) :: time
      real(wp), intent(inout), contiguous :: du(:, :)
      real(wp) :: vector(system%space%numbering%n_unknown)
      integer :: k

      do k = 1, size(vector)
         associate (dof => system%space%numbering%dof(k))
            vector(k) = direction(1 + mod(dof - 1, size(direction, 1)), (dof - 1)/size(direction, &
               1) + 1)
         end associate
      end do
      call add_to_dofs(system%space%numbering, vector, time, du)
   end subroutine move

end module emcon_contact_support
