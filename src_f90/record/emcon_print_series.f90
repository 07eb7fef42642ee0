!> What PRINT requests write to the history: series of nodes, elements, possible contact
!> constraints and contact pairs.
module emcon_print_series
   use emcon_errors, only : error_t
   use emcon_history, only : history_set_append, history_set_define, history_set_put, history_t
   use emcon_kinds, only : dp, wp
   use emcon_mesh, only : named_set_t
   use emcon_quantities, only : quantity_components, quantity_values
   use emcon_quantity_registry, only : at_contacts, at_elements, at_nodes, at_pairs, &
      at_sections, n_quantity_row, quantity_row, quantity_row_t
   use emcon_requests, only : output_contact_print, output_element_print, output_node_print, &
      output_section_print, output_t
   use emcon_stepper, only : stepper_t
   use emcon_text, only : string_t
   use emcon_turned_axes, only : turn_values
   implicit none
   private
   public :: series_t, print_series_define, print_series_write, is_due

   !> One requested quantity of one set.
   type :: series_t
      integer :: step = 0                        !! of the deck
      integer :: request = 0                     !! of that step
      integer :: place = 0                       !! of the members, one of the `at_` codes, or 0
      character(len=16) :: variable = ""
      logical :: is_total = .false.              !! the sum over the members
      integer :: i_set = 0                       !! as the history counts
      logical :: is_local = .false.              !! in the axes of the nodes
      integer, allocatable :: item(:)            !! the members
   end type series_t

   !> What of nodes is a vector, and may be told in their own axes.
   character(len=*), parameter :: turning(*) = [character(len=2) :: "U", "V", "RF"]

contains

   !> Declare the series of all PRINT requests of the deck.
   subroutine print_series_define(self, history, stepper, error)
      type(series_t), allocatable, intent(out) :: self(:)
      type(history_t), intent(inout) :: history
      type(stepper_t), intent(in) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(series_t) :: new
      integer :: i, j

      allocate(self(0))
      do i = 1, size(stepper%scene%step)
         do j = 1, size(stepper%scene%step(i)%output)
            new%place = findloc([output_node_print, output_element_print, output_contact_print, &
               output_section_print], stepper%scene%step(i)%output(j)%kind, 1)
            if (new%place == 0) cycle
            if (new%place == at_contacts .and. size(stepper%scene%pair) == 0) cycle
            new%step = i
            new%request = j
            call define_request(self, history, stepper, new, error)
         end do
      end do
   end subroutine print_series_define

   !> Declare the series of one request: each variable, its sum, and what pairs transmit.
   subroutine define_request(self, history, stepper, new, error)
      type(series_t), allocatable, intent(inout) :: self(:)
      type(history_t), intent(inout) :: history
      type(stepper_t), intent(in) :: stepper
      type(series_t), intent(inout) :: new
      type(error_t), allocatable, intent(inout) :: error
      logical :: has_totals, has_sums, has_counts
      type(quantity_row_t) :: row
      integer :: k

      associate (output => stepper%scene%step(new%step)%output(new%request))
         has_totals = output%totals .or. output%only_totals
         new%is_local = output%is_local
         do k = 1, size(output%variable)
            new%variable = output%variable(k)%text
            if (new%variable == "CNUM") cycle          ! counts are of pairs
            new%is_total = .false.
            if (.not. output%only_totals) call define(self, history, stepper, output, new, error)
            new%is_total = .true.
            if (has_totals) call define(self, history, stepper, output, new, error)
         end do
         if (new%place /= at_contacts .or. size(stepper%scene%pair) == 0) return
         has_sums = has_totals .and. has(output, "CF")
         has_counts = has_sums .or. has(output, "CNUM")
         new%place = at_pairs
         new%is_total = .false.
         do k = 1, n_quantity_row()
            row = quantity_row(k)
            if (row%place /= at_pairs) cycle
            new%variable = row%variable
            if (.not. merge(has_counts, has_sums, new%variable == "CNUM")) cycle
            if (quantity_components(row%variable, at_pairs, stepper%scene%n_dim) == 0) cycle
            call define(self, history, stepper, output, new, error)
         end do
      end associate
   end subroutine define_request

   !> Does a request name `variable`?
   pure logical function has(output, variable)
      type(output_t), intent(in) :: output
      character(len=*), intent(in) :: variable
      integer :: k

      has = .false.
      do k = 1, size(output%variable)
         has = has .or. output%variable(k)%text == variable
      end do
   end function has

   !> Declare one series; what an earlier request declared is used again.
   subroutine define(self, history, stepper, output, new, error)
      type(series_t), allocatable, intent(inout) :: self(:)
      type(history_t), intent(inout) :: history
      type(stepper_t), intent(in) :: stepper
      type(output_t), intent(in) :: output
      type(series_t), intent(inout) :: new
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: set, variable
      integer, allocatable :: label(:)
      integer :: i, n_component

      if (allocated(error)) return
      call find_items(stepper, output, new%place, set, new%item, label)
      variable = trim(new%variable)
      n_component = quantity_components(variable, new%place, stepper%scene%n_dim)
      if (new%is_total) then
         variable = "TOTAL_" // variable
         label = [0]
      end if
      do i = 1, size(self)
         if (.not. is_same(self(i), new)) cycle
         new%i_set = self(i)%i_set
         new%is_local = self(i)%is_local
         self = [self, new]
         return
      end do
      call history_set_define(history, set, variable, label, n_component, new%i_set, error)
      if (.not. allocated(error)) call put_pairs(history, stepper, set, variable, new, error)
      self = [self, new]
   end subroutine define

   !> Do two series hold the same quantity of the same members?
   pure logical function is_same(a, b)
      type(series_t), intent(in) :: a, b

      is_same = a%place == b%place .and. a%variable == b%variable &
         .and. (a%is_total .eqv. b%is_total) .and. size(a%item) == size(b%item)
      if (is_same) is_same = all(a%item == b%item)
   end function is_same

   !> Name, members and labels of the set that `output` is about.
   subroutine find_items(stepper, output, place, set, item, label)
      type(stepper_t), intent(in) :: stepper
      type(output_t), intent(in) :: output
      integer, intent(in) :: place               !! one of the `at_` codes
      character(len=:), allocatable, intent(out) :: set
      integer, allocatable, intent(out) :: item(:), label(:)
      integer :: i

      associate (scene => stepper%scene, system => stepper%march%system)
         select case (place)
         case (at_nodes)
            call find_members("ALL_NODES", scene%set%node, scene%node%label( &
               :size(scene%node%label) - count(scene%node%turned%stand_in > 0)))
         case (at_elements)
            call find_members("ALL_ELEMENTS", scene%set%element, scene%element%label)
         case (at_contacts)
            set = "CONTACT"
            item = [(i, i = system%first_constraint(1) + 1, &
               system%first_constraint(system%n_pair + 1))]
            allocate(label(0))
            do i = 1, system%n_pair
               label = [label, scene%node%label(system%contact(i)%contact%node)]
            end do
         case (at_sections)
            set = output%name
            item = [output%set]
            label = [0]
         case default
            set = "PAIRS"
            item = [(i, i = 1, size(scene%pair))]
            label = item
         end select
      end associate

   contains

      !> Of the set asked for, or of all nodes or elements, which have the labels `all_labels`.
      subroutine find_members(all_name, sets, all_labels)
         character(len=*), intent(in) :: all_name
         type(named_set_t), intent(in) :: sets(:)
         integer, intent(in) :: all_labels(:)

         set = all_name
         item = [(i, i = 1, size(all_labels))]
         if (output%set > 0) then
            set = sets(output%set)%name
            item = sets(output%set)%item
         end if
         label = all_labels(item)
      end subroutine find_members

   end subroutine find_items

   !> Beside a series of constraints the pair of each; beside series of pairs their surfaces.
   subroutine put_pairs(history, stepper, set, variable, series, error)
      type(history_t), intent(inout) :: history
      type(stepper_t), intent(in) :: stepper
      character(len=*), intent(in) :: set, variable
      type(series_t), intent(in) :: series
      type(error_t), allocatable, intent(out) :: error
      type(string_t) :: slave(size(stepper%scene%pair)), master(size(stepper%scene%pair))
      integer :: i

      associate (scene => stepper%scene, first => stepper%march%system%first_constraint)
         if (series%place == at_contacts .and. .not. series%is_total) then
            call history_set_put(history, set, variable // "_pair", &
               [(count(first < series%item(i)), i = 1, size(series%item))], error)
         else if (series%place == at_pairs) then
            do i = 1, size(scene%pair)
               slave(i)%text = scene%surface(scene%pair(i)%slave)%name
               master(i)%text = scene%surface(scene%pair(i)%master)%name
            end do
            call history_set_put(history, set, "SLAVE", slave, error)
            if (.not. allocated(error)) call history_set_put(history, set, "MASTER", master, error)
         end if
      end associate
   end subroutine put_pairs

   !> Is the request due now: at its increments, its time points, or at the end of the step?
   pure logical function is_due(stepper, output, last_time)
      type(stepper_t), intent(in) :: stepper
      type(output_t), intent(in) :: output
      real(wp), intent(in) :: last_time          !! of the last record [T]
      real(wp) :: before, now, slack

      associate (state => stepper%march%state)
         if (allocated(output%time)) then
            slack = 0.5_wp*sqrt(epsilon(1.0_wp)) &
               *stepper%scene%step(state%clock%i_step)%time%duration
            before = last_time - state%clock%start_time
            now = state%clock%time - state%clock%start_time
            is_due = any(output%time > before + slack .and. output%time <= now + slack)
         else if (output%frequency == 0) then
            is_due = .false.
         else
            is_due = mod(state%clock%increment - state%clock%n_before, output%frequency) == 0
         end if
         is_due = is_due .or. (output%frequency > 0 &
            .and. state%clock%n_grid >= stepper%march%grid%n_grid)
      end associate
   end function is_due

   !> Append what requests of this step are due, once what several of them ask for.
   subroutine print_series_write(self, history, stepper, last_time, error)
      type(series_t), intent(in) :: self(:)
      type(history_t), intent(inout) :: history
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: last_time          !! of the last record [T]
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: values(:, :)
      logical :: is_written(size(self))
      integer :: i

      is_written = .false.
      do i = 1, size(self)
         associate (series => self(i), i_step => stepper%march%state%clock%i_step)
            if (series%step /= i_step) cycle
            if (.not. is_due(stepper, stepper%scene%step(i_step)%output(series%request), &
               last_time)) cycle
            if (any(is_written .and. self%i_set == series%i_set)) cycle
            is_written(i) = .true.
            values = quantity_values(stepper, trim(series%variable), series%place)
            if (series%is_local .and. any(series%variable == turning)) call turn_values( &
               stepper%scene%node%turned, values)
            values = values(:, series%item)
            if (series%is_total) values = reshape(sum(values, dim=2), [size(values, 1), 1])
            call history_set_append(history, series%i_set, real(stepper%march%state%clock%time, &
               dp), values, error)
            if (allocated(error)) return
         end associate
      end do
   end subroutine print_series_write

end module emcon_print_series
