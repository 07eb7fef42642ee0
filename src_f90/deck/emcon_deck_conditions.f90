!> What is prescribed and what loads act in a step, and how they carry over from step to step.
!>
!> What a step gives for a place (node and degree of freedom; element and face; gravity of an
!> element) replaces what earlier steps gave there. Within a step loads on one place add up, each
!> with its own amplitude; of two prescribed displacements the last one holds. OP=NEW drops what
!> earlier steps gave.
!>
!> What carries over keeps its value. An amplitude over step time has ended with its step: its
!> last value stays. A load dropped in a static step runs to zero over that step.
module emcon_deck_conditions
   use emcon_amplitudes, only : amplitude_t, find_amplitude_value
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_steps, only : load_moment, load_point, load_t, prescribed_t, step_t
   implicit none
   private
   public :: conditions_t, conditions_init, conditions_carry, conditions_store
   public :: put_prescribed, drop_prescribed, put_load, drop_loads

   !> What holds in the step that is being read. The freedoms of a node are n_dim displacements,
   !> then the rotations of a reference node. A slot is the index of the entry at a place, 0:
   !> none. Gravity has the slot of face 0. The loads at a place are a list: the slot is its head,
   !> `load_next` leads on; all of them were given in one step.
   type :: conditions_t
      integer :: step = 0                          !! number of the step, 0: before the first
      integer :: n_prescribed = 0, n_load = 0
      type(prescribed_t), allocatable :: prescribed(:)
      type(load_t), allocatable :: load(:)
      integer, allocatable :: prescribed_step(:), load_step(:)         !! the step that gave it
      logical, allocatable :: prescribed_dropped(:), load_dropped(:)
      integer, allocatable :: load_next(:)
      integer, allocatable :: prescribed_slot(:, :)                    !! (freedoms, n_node)
      integer, allocatable :: point_slot(:, :)                         !! (freedoms, n_node)
      integer, allocatable :: element_slot(:, :)                       !! (-1:n_face, n_element)
   end type conditions_t

contains

   subroutine conditions_init(self, scene)
      type(conditions_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      integer :: k

      allocate(self%prescribed(16), self%prescribed_step(16), self%prescribed_dropped(16))
      allocate(self%load(16), self%load_step(16), self%load_dropped(16), self%load_next(16))
      associate (n_dim => scene%n_dim, n_node => size(scene%node%label))
         allocate(self%prescribed_slot(sum([(k, k = 1, n_dim)]), n_node), source=0)
         allocate(self%point_slot(sum([(k, k = 1, n_dim)]), n_node), source=0)
      end associate
      allocate(self%element_slot(-1:maxval(scene%element%kinds%n_face), &
         size(scene%element%label)), source=0)
   end subroutine conditions_init

   !> Go to the next step: drop what was dropped, keep the last values of `last`.
   subroutine conditions_carry(self, amplitude, last, time)
      type(conditions_t), intent(inout) :: self
      type(amplitude_t), intent(in) :: amplitude(:)
      type(step_t), intent(in) :: last             !! the step that ends
      real(wp), intent(in) :: time                 !! total time at its start [T]
      integer :: i, n

      self%step = self%step + 1
      self%prescribed_slot = 0
      n = 0
      do i = 1, self%n_prescribed
         if (self%prescribed_dropped(i)) cycle
         n = n + 1
         self%prescribed(n) = self%prescribed(i)
         self%prescribed_step(n) = self%prescribed_step(i)
         self%prescribed_dropped(n) = .false.
         associate (entry_n => self%prescribed(n))
            self%prescribed_slot(entry_n%dof, entry_n%node) = n
            ! What stands before the first step has not begun.
            if (self%step > 1) call end_amplitude(amplitude, last%time%duration, time, &
               entry_n%amplitude, entry_n%value, entry_n%before)
         end associate
      end do
      self%n_prescribed = n
      self%point_slot = 0
      self%element_slot = 0
      n = 0
      do i = 1, self%n_load
         if (self%load_dropped(i)) cycle
         n = n + 1
         self%load(n) = self%load(i)
         self%load_step(n) = self%load_step(i)
         self%load_dropped(n) = .false.
         associate (load => self%load(n))
            self%load_next(n) = load_slot(self, load)
            call set_load_slot(self, load, n)
            call end_amplitude(amplitude, last%time%duration, time, load%amplitude, load%value, &
               load%value_start)
         end associate
      end do
      self%n_load = n
   end subroutine conditions_carry

   !> The value at the end of a step. An amplitude over step time is over: that value stays.
   pure subroutine end_amplitude(amplitude, duration, time, i_amplitude, value, value_end)
      type(amplitude_t), intent(in) :: amplitude(:)
      real(wp), intent(in) :: duration, time       !! of the step, and at its start [T]
      integer, intent(inout) :: i_amplitude
      real(wp), intent(inout) :: value
      real(wp), intent(out) :: value_end
      real(wp) :: factor, slope

      value_end = value
      if (i_amplitude == 0) return
      associate (table => amplitude(i_amplitude))
         call find_amplitude_value(table, merge(time + duration, duration, table%is_total_time), &
            factor, slope)
         value_end = value*factor
         if (table%is_total_time) return
      end associate
      value = value_end
      i_amplitude = 0
   end subroutine end_amplitude

   elemental logical function is_on_node(load)
      type(load_t), intent(in) :: load

      is_on_node = load%kind == load_point .or. load%kind == load_moment
   end function is_on_node

   pure integer function load_slot(self, load)
      type(conditions_t), intent(in) :: self
      type(load_t), intent(in) :: load

      if (is_on_node(load)) then
         load_slot = self%point_slot(load%place, load%target)
      else
         load_slot = self%element_slot(load%place, load%target)
      end if
   end function load_slot

   pure subroutine set_load_slot(self, load, i)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(in) :: load
      integer, intent(in) :: i

      if (is_on_node(load)) then
         self%point_slot(load%place, load%target) = i
      else
         self%element_slot(load%place, load%target) = i
      end if
   end subroutine set_load_slot

   !> All that holds in the step that was read.
   subroutine conditions_store(self, n_dim, step)
      type(conditions_t), intent(in) :: self
      integer, intent(in) :: n_dim                 !! displacements of a node
      type(step_t), intent(inout) :: step
      logical :: holds(self%n_load), is_turn(self%n_prescribed), is_dropped(self%n_prescribed)
      type(prescribed_t), allocatable :: angle(:)
      integer, allocatable :: node(:)
      logical, allocatable :: is_first(:)
      integer :: k

      is_dropped = self%prescribed_dropped(:self%n_prescribed)
      is_turn = self%prescribed(:self%n_prescribed)%dof > n_dim
      step%prescribed = pack(self%prescribed(:self%n_prescribed), .not. (is_dropped .or. is_turn))
      angle = pack(self%prescribed(:self%n_prescribed), is_turn .and. .not. is_dropped)
      is_first = [(all(angle(:k - 1)%node /= angle(k)%node), k = 1, size(angle))]
      node = pack(angle%node, is_first)
      if (allocated(step%turn)) deallocate(step%turn)
      allocate(step%turn(size(node)))
      do k = 1, size(node)
         step%turn(k)%angle = pack(angle, angle%node == node(k))
      end do
      holds = .not. self%load_dropped(:self%n_load)
      if (step%scheme%loads_ramp) then
         holds = holds .or. self%load(:self%n_load)%value_start /= 0.0_wp
      end if
      step%load = pack(self%load(:self%n_load), holds)
   end subroutine conditions_store

   !> Set a prescribed degree of freedom, in the place of an earlier one; `is_other`: the same step
   !> has said otherwise before.
   subroutine put_prescribed(self, new, is_other)
      type(conditions_t), intent(inout) :: self
      type(prescribed_t), intent(in) :: new
      logical, intent(out) :: is_other
      real(wp) :: before
      integer :: i, n

      i = self%prescribed_slot(new%dof, new%node)
      before = 0.0_wp
      if (i > 0) before = self%prescribed(i)%before
      is_other = .false.
      if (i > 0) then
         if (self%prescribed_step(i) == self%step) is_other = differ(self%prescribed(i), new)
      else
         n = self%n_prescribed
         if (n == size(self%prescribed)) then
            self%prescribed = [self%prescribed, self%prescribed]
            self%prescribed_step = [self%prescribed_step, self%prescribed_step]
            self%prescribed_dropped = [self%prescribed_dropped, self%prescribed_dropped]
         end if
         i = n + 1
         self%n_prescribed = i
         self%prescribed_slot(new%dof, new%node) = i
      end if
      self%prescribed(i) = new
      self%prescribed(i)%before = before
      self%prescribed_step(i) = self%step
      self%prescribed_dropped(i) = .false.
   end subroutine put_prescribed

   !> Whether two entries prescribe different displacements. Amplitudes do not change zero.
   pure logical function differ(one, other)
      type(prescribed_t), intent(in) :: one, other

      differ = one%value /= other%value .or. (one%is_frozen .neqv. other%is_frozen) &
         .or. (one%amplitude /= other%amplitude .and. one%value /= 0.0_wp)
   end function differ

   !> Add a load to what this step gives for its place, or put it in the place of what earlier
   !> steps gave there.
   subroutine put_load(self, new)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(in) :: new
      integer :: i, head
      real(wp) :: value_start

      head = load_slot(self, new)
      i = 0
      value_start = 0.0_wp
      if (head > 0) then
         if (self%load_step(head) /= self%step) then
            call replace_loads(self, new, head, i, value_start)
            head = 0
         end if
      end if
      if (i == 0) then
         if (self%n_load == size(self%load)) then
            self%load = [self%load, self%load]
            self%load_step = [self%load_step, self%load_step]
            self%load_dropped = [self%load_dropped, self%load_dropped]
            self%load_next = [self%load_next, self%load_next]
         end if
         self%n_load = self%n_load + 1
         i = self%n_load
      end if
      call set_load_slot(self, new, i)
      self%load(i) = new
      self%load(i)%value_start = value_start
      self%load_step(i) = self%step
      self%load_dropped(i) = .false.
      self%load_next(i) = head
   end subroutine put_load

   !> Drop the list of loads from `head` on. `new` goes on from the sum of those that act as it
   !> does, in the place `i` of one of them (0: there is none); gravity in another direction runs
   !> to zero.
   pure subroutine replace_loads(self, new, head, i, value_start)
      type(conditions_t), intent(inout) :: self
      type(load_t), intent(in) :: new
      integer, intent(in) :: head
      integer, intent(out) :: i
      real(wp), intent(out) :: value_start
      integer :: k

      i = 0
      value_start = 0.0_wp
      k = head
      do while (k > 0)
         associate (old => self%load(k))
            old%value = 0.0_wp
            old%amplitude = 0
            if (all(old%direction == new%direction) .and. all(old%point == new%point)) then
               value_start = value_start + old%value_start
               old%value_start = 0.0_wp
               i = k
            end if
         end associate
         self%load_dropped(k) = .true.
         k = self%load_next(k)
      end do
   end subroutine replace_loads

   !> Drop the loads of earlier steps that one kind of card gave.
   subroutine drop_loads(self, given)
      type(conditions_t), intent(inout) :: self
      integer, intent(in) :: given                 !! one of `by_`
      integer :: i

      do i = 1, self%n_load
         if (self%load(i)%given /= given) cycle
         if (self%load_step(i) == self%step) cycle
         self%load_dropped(i) = .true.
         self%load(i)%value = 0.0_wp
         self%load(i)%amplitude = 0
      end do
   end subroutine drop_loads

   !> Drop what earlier steps prescribed.
   subroutine drop_prescribed(self)
      type(conditions_t), intent(inout) :: self
      integer :: i

      do i = 1, self%n_prescribed
         if (self%prescribed_step(i) < self%step) self%prescribed_dropped(i) = .true.
      end do
   end subroutine drop_prescribed

end module emcon_deck_conditions
