!> Output requests: *NODE FILE and its kin, and *OUTPUT with *NODE OUTPUT and its kin: with FIELD
!> they ask for what FILE requests do, with HISTORY for what PRINT requests do.
!>
!> Requests carry over to later steps until a step has a request of the same kind.
module emcon_deck_output
   use emcon_deck_fields, only : data_error, data_open, data_t, data_warning, get_name, next_line
   use emcon_deck_named, only : hint_at_set, set_names
   use emcon_deck_reader, only : card_error, card_t, card_warning, has_option, note_idle, &
      option_count, option_name, option_word, reader_t
   use emcon_deck_surfaces, only : surface_names
   use emcon_deck_tables, only : table_names
   use emcon_diagnostics, only : quoted, suggestion
   use emcon_mesh, only : named_set_t
   use emcon_name_index, only : name_index_find, name_index_t
   use emcon_quantity_registry, only : at_contacts, at_elements, at_nodes, at_sections, &
      quantities_of_card
   use emcon_requests, only : output_contact_file, output_contact_print, output_element_file, &
      output_element_print, output_energy_print, output_node_file, output_node_print, &
      output_section_print, output_t
   use emcon_scene, only : scene_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: requests_t, requests_init, read_output, is_output

   !> The requests that hold in the step that is being read.
   type :: requests_t
      type(output_t), allocatable :: output(:)
      integer, allocatable :: step(:)              !! the step that gave each
      logical, allocatable :: has_times(:)         !! does it say when?
      type(card_t) :: heading                      !! the last *OUTPUT,
      type(output_t) :: of_heading                 !! and when it asks for what stands below it
      integer :: frequency = 1                     !! *OUTPUT, FREQUENCY= without FIELD or HISTORY,
      integer :: frequency_step = 0                !! and its step
   end type requests_t

   !> One keyword, and the quantities that it can write; place 0: the energies of the model.
   type :: output_row_t
      character(len=12) :: keyword
      integer :: kind
      integer :: place = 0                         !! one of the `at_` codes
      logical :: to_field_file = .false.
      character(len=14) :: preselect = ""          !! what PRESELECT asks for; none: all
   end type output_row_t

   type(output_row_t), parameter :: output_rows(*) = [ &
      output_row_t("NODEFILE", output_node_file, at_nodes, .true., "U V RF"), &
      output_row_t("NODEPRINT", output_node_print, at_nodes, .false., "U V RF"), &
      output_row_t("ELFILE", output_element_file, at_elements, .true., "S E"), &
      output_row_t("ELPRINT", output_element_print, at_elements, .false., "S E"), &
      output_row_t("CONTACTFILE", output_contact_file, at_contacts, .true., "CDIS CSTR"), &
      output_row_t("CONTACTPRINT", output_contact_print, at_contacts, .false., "CDIS CSTR"), &
      output_row_t("SECTIONPRINT", output_section_print, at_sections), &
      output_row_t("ENERGYPRINT", output_energy_print)]

   !> Variables of other programs that are not written here: a warning says so.
   character(len=*), parameter :: unwritten(*) = [character(len=5) :: "PE", "PEEQ", "PEMAG", &
      "CEEQ", "LE", "EE", "IE", "NE", "THE", "NOE", "ERR", "HER", "ZZS", "PHS", "MAXS", &
      "MAXE", "MAXU", "SMID", "SNEG", "SPOS", "SF", "SVF", "SDV", "NT", "RFL", "HFL", "HFLF", &
      "A", "CENT", "EMAS", "CELS", "CFN", "CFS", "PCON"]

   character(len=*), parameter :: energies(4) = [character(len=6) :: "ALLKE", "ALLSE", "ALLWK", &
      "ETOTAL"]

   !> Groups of the history that have their names for themselves.
   character(len=*), parameter :: own_groups(*) = [character(len=7) :: "BODIES", "CONTACT", &
      "PAIRS", "RUN"]

contains

   subroutine requests_init(self)
      type(requests_t), intent(out) :: self

      allocate(self%output(0), self%step(0), self%has_times(0))
   end subroutine requests_init

   pure logical function is_output(card)
      type(card_t), intent(in) :: card

      is_output = any(output_rows%keyword == card%name) .or. is_below(card) &
         .or. card%name == "OUTPUT"
   end function is_output

   !> Is it one of those that stand below *OUTPUT?
   pure logical function is_below(card)
      type(card_t), intent(in) :: card

      is_below = any(card%name == [character(len=13) :: "NODEOUTPUT", "ELEMENTOUTPUT", &
         "CONTACTOUTPUT", "ENERGYOUTPUT"])
   end function is_below

   !> The row of `output_rows` of a card; 0: there is no *OUTPUT above it.
   pure integer function row_of(self, card) result(i_row)
      type(requests_t), intent(in) :: self
      type(card_t), intent(in) :: card
      character(len=:), allocatable :: name

      name = card%name
      i_row = 0
      if (is_below(card)) then
         if (self%heading%step /= card%step) return
         name = name(:index(name, "OUTPUT") - 1)
         if (name == "ELEMENT") name = "EL"
         if (has_option(self%heading, "FIELD") .and. name /= "ENERGY") then
            name = name // "FILE"
         else
            name = name // "PRINT"
         end if
      end if
      i_row = findloc(output_rows%keyword == name, .true., 1)
   end function row_of

   !> Take in a card of step `card%step`.
   subroutine read_output(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(requests_t), intent(inout) :: self
      integer :: i_row

      if (card%name == "OUTPUT") then
         call read_heading(reader, card, scene, self)
         return
      end if
      i_row = row_of(self, card)
      if (i_row > 0) then
         call read_request(reader, card, output_rows(i_row), scene, self)
      else
         call card_error(reader, card, "there is no *OUTPUT before it in the step")
      end if
   end subroutine read_output

   !> *OUTPUT: what PRESELECT and ALL ask for; the rest stands below it.
   subroutine read_heading(reader, card, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(requests_t), intent(inout) :: self
      logical :: is_field, is_history
      integer :: i, n_errors

      self%heading = card
      n_errors = reader%log%n_errors
      is_field = has_option(card, "FIELD")
      is_history = has_option(card, "HISTORY")
      if (.not. (is_field .or. is_history)) then
         call read_frequency(reader, card, self)
         return
      else if (is_field .eqv. is_history) then
         call card_error(reader, card, "either FIELD or HISTORY is to be given")
         return
      end if
      self%of_heading = output_t()
      call read_times(reader, card, self%of_heading)
      if (has_option(card, "VARIABLE") .and. reader%log%n_errors == n_errors) then
         do i = 1, size(output_rows)
            if (output_rows(i)%to_field_file .neqv. is_field) cycle
            if (is_history .and. output_rows(i)%place > 0) cycle
            if (output_rows(i)%place == at_contacts .and. size(scene%pair) == 0) cycle
            if (output_rows(i)%place == at_sections) cycle
            call read_request(reader, card, output_rows(i), scene, self)
            if (reader%log%n_errors > n_errors) exit
         end do
      end if
   end subroutine read_heading

   !> *OUTPUT of CalculiX, which has neither FIELD nor HISTORY: its FREQUENCY is that of all
   !> requests of the step, before it and behind, that have none of their own.
   subroutine read_frequency(reader, card, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(requests_t), intent(inout) :: self

      if (has_option(card, "VARIABLE")) then
         call card_error(reader, card, "either FIELD or HISTORY is to be given")
         return
      end if
      self%frequency = 1
      self%frequency_step = card%step
      call option_count(reader, card, "FREQUENCY", 0, self%frequency)
      if (self%frequency == 1) call note_idle(reader, card%title, "every increment is written " &
         // "unless a request says otherwise")
      where (self%step == card%step .and. .not. self%has_times) self%output%frequency &
         = self%frequency
   end subroutine read_frequency

   !> Take in a request for variables of `row`.
   subroutine read_request(reader, card, row, scene, self)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(output_row_t), intent(in) :: row
      type(scene_t), intent(in) :: scene
      type(requests_t), intent(inout) :: self
      type(output_t) :: new
      type(output_t), allocatable :: grown(:)
      integer, allocatable :: kept(:)
      character(len=:), allocatable :: word
      logical :: is_empty, has_times
      integer :: i, n

      new%kind = row%kind
      new%origin = card%origin
      call read_variables(reader, card, row, new)
      call read_set(reader, card, scene, new, is_empty)
      if (is_empty) return
      if (self%frequency_step == card%step) new%frequency = self%frequency
      has_times = says_when(card)
      if (is_below(card) .or. card%name == "OUTPUT") then
         has_times = says_when(self%heading)
         if (has_times) new%frequency = self%of_heading%frequency
         if (allocated(self%of_heading%time)) new%time = self%of_heading%time
      else
         call read_times(reader, card, new)
      end if
      if (option_name(card, "TOTALS") /= "") then
         call option_word(reader, card, "TOTALS", "YES, ONLY, NO", word)
         new%totals = word == "YES" .or. word == "ONLY"
         new%only_totals = word == "ONLY"
      end if
      call read_pair(reader, card, scene, new)
      call check_contact(reader, card, scene, new)
      call read_axes(reader, card, scene, self, new)
      kept = pack([(i, i = 1, size(self%step))], &
         self%output%kind /= new%kind .or. self%step == card%step)
      call check_name(reader, card, self%output, kept, new)
      n = size(kept)
      allocate(grown(n + 1))
      do i = 1, n
         grown(i) = self%output(kept(i))
      end do
      grown(n + 1) = new
      self%step = [self%step(kept), card%step]
      self%has_times = [self%has_times(kept), has_times]
      call move_alloc(grown, self%output)
   end subroutine read_request

   !> GLOBAL: vectors of nodes are printed in the axes of these, or in those of the model.
   subroutine read_axes(reader, card, scene, self, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(requests_t), intent(in) :: self
      type(output_t), intent(inout) :: new
      character(len=:), allocatable :: word
      integer :: i

      if (new%kind /= output_node_print .or. card%name /= "NODEPRINT") return
      call option_word(reader, card, "GLOBAL", "NO, YES", word)
      new%is_local = word == "NO" .and. size(scene%node%turned) > 0
      do i = 1, size(self%output)
         if (self%output(i)%kind /= new%kind .or. self%output(i)%set /= new%set) cycle
         if (self%output(i)%is_local .eqv. new%is_local) cycle
         call card_error(reader, card, "the same nodes are printed with another GLOBAL before; " &
            // "give both the same, or one of them a set of its own")
         return
      end do
   end subroutine read_axes
   !> MASTER= and SLAVE= of *CONTACT PRINT: totals of that pair, beside those of the others.
   subroutine read_pair(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(output_t), intent(inout) :: new
      integer :: slave, master

      if (.not. (has_option(card, "MASTER") .or. has_option(card, "SLAVE"))) return
      new%totals = .true.
      new%only_totals = .true.
      slave = name_index_find(reader%names%surfaces, option_name(card, "SLAVE"))
      master = name_index_find(reader%names%surfaces, option_name(card, "MASTER"))
      if (any(scene%pair%slave == slave .and. scene%pair%master == master)) return
      if (any(scene%tie%slave == slave .and. scene%tie%master == master)) return
      if (.not. reader%doubt%names) call card_error(reader, card, "SLAVE=" &
         // quoted(option_name(card, "SLAVE")) // " and MASTER=" &
         // quoted(option_name(card, "MASTER")) // " are no *CONTACT PAIR")
   end subroutine read_pair

   !> Contact output needs contact, and totals of pairs are totals of forces.
   subroutine check_contact(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(output_t), intent(in) :: new
      integer :: i

      if (all(new%kind /= [output_contact_file, output_contact_print])) return
      if (size(scene%pair) == 0 .and. .not. reader%doubt%names) then
         call card_warning(reader, card, "there is no *CONTACT PAIR that is not tied: nothing " &
            // "will be written")
      else if (new%totals .and. all([(new%variable(i)%text /= "CF", &
         i = 1, size(new%variable))])) then
         call card_warning(reader, card, "TOTALS has no effect without CF")
      end if
   end subroutine check_contact

   !> The variables on the data lines, in their short forms.
   subroutine read_variables(reader, card, row, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(output_row_t), intent(in) :: row
      type(output_t), intent(inout) :: new
      type(data_t) :: data
      type(string_t), allocatable :: list(:), longer(:)
      character(len=:), allocatable :: name, known, instead
      logical, allocatable :: is_wanted(:)
      integer :: i, k, n_before

      call list_variables(row, list, longer, known)
      allocate(is_wanted(size(list)), source=.false.)
      n_before = reader%log%n_errors + reader%log%n_warnings
      if (has_option(card, "VARIABLE")) then
         call option_word(reader, card, "VARIABLE", "PRESELECT, ALL", name)
         is_wanted = name == "ALL" .or. preselected(row, list)
      end if
      call data_open(data, card)
      do while (next_line(reader, data))
         do k = 1, data%n
            if (data%to(k) < data%from(k)) cycle
            call get_name(reader, data, k, "variable", name)
            if (is_below(card)) name = whole_of(name)
            do i = 1, size(list)
               if (is_name_of(name, list(i)%text, longer(i)%text)) exit
            end do
            if (i <= size(list)) then
               is_wanted(i) = .true.
            else if (reader%is_lenient .or. is_below(card) .or. any(unwritten == name)) then
               call say_instead(name, instead)
               call data_warning(reader, data, "output variable " // quoted(name) &
                  // " is not supported, left out; " // instead // "supported: " // known)
            else
               call data_error(reader, data, "output variable " // quoted(name) &
                  // " is not supported; supported: " // known)
            end if
         end do
      end do
      if (row%kind == output_energy_print .and. .not. any(is_wanted)) is_wanted = .true.
      if (.not. any(is_wanted) .and. reader%log%n_errors + reader%log%n_warnings == n_before) then
         call card_warning(reader, card, "no variable is named, nothing will be written; known: " &
            // known)
      end if
      allocate(new%variable(count(is_wanted)))
      k = 0
      do i = 1, size(list)
         if (.not. is_wanted(i)) cycle
         k = k + 1
         new%variable(k) = list(i)
      end do
   end subroutine read_variables

   !> The variable of which `name` is a component: U of U2, S of S11.
   pure function whole_of(name) result(whole)
      character(len=*), intent(in) :: name
      character(len=max(1, verify(name, "0123456789", .true.))) :: whole

      whole = name
   end function whole_of

   !> Does `name` stand for a variable? Between its short and its long form, as CSTR, CSTRE and
   !> CSTRESS: CalculiX reads four letters.
   pure logical function is_name_of(name, short, long)
      character(len=*), intent(in) :: name, short, long

      is_name_of = name == short .or. name == long &
         .or. (index(name, short) == 1 .and. index(long, name) == 1)
   end function is_name_of

   !> What says the same as a variable that is not written: "...; ", or nothing.
   pure subroutine say_instead(name, text)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text

      select case (name)
      case ("CELS")
         text = "the history has it in the column contact_energy; "
      case ("CFN", "CFS")
         text = "CF is the whole force; "
      case ("LE", "EE")
         text = "E is the strain; "
      case ("PE", "PEEQ", "PEMAG", "CEEQ")
         text = "it is 0, materials are elastic; "
      case default
         text = ""
      end select
   end subroutine say_instead

   !> What PRESELECT asks for, of the variables of a row.
   pure function preselected(row, list)
      type(output_row_t), intent(in) :: row
      type(string_t), intent(in) :: list(:)
      logical :: preselected(size(list))
      integer :: i

      preselected = [(row%preselect == "" .or. index(" " // trim(row%preselect) // " ", &
         " " // list(i)%text // " ") > 0, i = 1, size(list))]
   end function preselected

   !> What a card may ask for, other names of the same, and all of them in one text.
   pure subroutine list_variables(row, list, longer, known)
      type(output_row_t), intent(in) :: row
      type(string_t), allocatable, intent(out) :: list(:), longer(:)
      character(len=:), allocatable, intent(out) :: known
      integer :: i

      if (row%place > 0) then
         call quantities_of_card(row%place, row%to_field_file, list, longer)
      else
         allocate(list(size(energies)))
         do i = 1, size(list)
            list(i)%text = trim(energies(i))
         end do
         longer = list
      end if
      known = list(1)%text
      do i = 2, size(list)
         known = known // " " // list(i)%text
      end do
   end subroutine list_variables

   !> The set that a request names; nothing is written of one without members.
   subroutine read_set(reader, card, scene, new, is_empty)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(output_t), intent(inout) :: new
      logical, intent(out) :: is_empty

      is_empty = .false.
      select case (new%kind)
      case (output_node_file, output_node_print)
         call look_up("NSET", "node set", scene%set%node, reader%names%node_sets)
      case (output_element_file, output_element_print)
         call look_up("ELSET", "element set", scene%set%element, reader%names%element_sets)
      case (output_section_print)
         call read_section(reader, card, scene, new)
         is_empty = new%set == 0
      end select

   contains

      subroutine look_up(option, what, set, index_of)
         character(len=*), intent(in) :: option, what
         type(named_set_t), intent(in) :: set(:)
         type(name_index_t), intent(in) :: index_of
         character(len=:), allocatable :: name, hint

         name = option_name(card, option)
         if (name == "") return
         new%set = name_index_find(index_of, name)
         is_empty = .false.
         if (new%set > 0 .and. any(new%kind == [output_node_print, output_element_print])) then
            is_empty = size(set(new%set)%item) == 0
         end if
         if (is_empty .and. .not. (reader%doubt%nodes .or. reader%doubt%elements)) call &
            card_warning(reader, card, "the set " // quoted(name) // " is empty: nothing will be " &
            // "written")
         if (new%set == 0 .and. .not. reader%doubt%names) then
            call hint_at_set(reader, what, name, set_names(set), hint)
            call card_error(reader, card, "unknown set " // option // "=" // quoted(name) // hint)
         end if
         if (any(new%kind == [output_node_file, output_element_file])) then
            call card_warning(reader, card, option &
               // "= does not narrow it: the field file holds all nodes and elements")
         end if
      end subroutine look_up

   end subroutine read_set

   pure logical function says_when(card)
      type(card_t), intent(in) :: card

      says_when = has_option(card, "FREQUENCY") .or. has_option(card, "TIMEPOINTS")
   end function says_when

   !> Two sections of a step have two names.
   subroutine check_name(reader, card, output, kept, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(output_t), intent(in) :: output(:)
      integer, intent(in) :: kept(:)             !! those of the step, and what stays of others
      type(output_t), intent(in) :: new
      integer :: i, k

      if (new%kind /= output_section_print) return
      if (any(own_groups == new%name)) call card_error(reader, card, quoted(new%name) // " is a " &
         // "group of the history of its own; another NAME= is needed")
      do k = 1, size(kept)
         i = kept(k)
         if (output(i)%kind /= new%kind .or. output(i)%set == new%set) cycle
         if (output(i)%name == new%name) call card_error(reader, card, "another section of the " &
            // "step has the name " // quoted(new%name) // "; NAME= tells them apart")
      end do
   end subroutine check_name

   !> The surface of a section, and its name in the history; without surface 0.
   subroutine read_section(reader, card, scene, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(output_t), intent(inout) :: new
      character(len=:), allocatable :: name
      integer :: i

      name = option_name(card, "SURFACE")
      new%name = option_name(card, "NAME")
      if (new%name == "") new%name = name
      i = name_index_find(reader%names%surfaces, name)
      if (name == "") then
         call card_error(reader, card, "SURFACE= is missing: the faces whose force is to be told")
      else if (i == 0) then
         if (.not. reader%doubt%names) call card_error(reader, card, "unknown surface " &
            // quoted(name) // suggestion(name, surface_names(scene%surface)))
      else if (.not. allocated(scene%surface(i)%element)) then
         i = 0
      else if (size(scene%surface(i)%element) == 0) then
         call card_error(reader, card, "surface " // quoted(name) // " has no faces of elements; " &
            // "the force on nodes is told by *NODE PRINT with RF and TOTALS=YES")
      else
         new%set = i
      end if
   end subroutine read_section

   !> When: by FREQUENCY or at the times of a table.
   subroutine read_times(reader, card, new)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(output_t), intent(inout) :: new
      character(len=:), allocatable :: name
      integer :: i

      call option_count(reader, card, "FREQUENCY", 0, new%frequency)
      name = option_name(card, "TIMEPOINTS")
      if (name == "") return
      if (has_option(card, "FREQUENCY")) then
         call card_error(reader, card, "FREQUENCY and TIME POINTS exclude each other")
      end if
      i = name_index_find(reader%names%times, name)
      if (i > 0) then
         new%time = reader%time_points(i)%time
      else if (.not. reader%doubt%names) then
         call card_error(reader, card, "unknown time points " // quoted(name) &
            // suggestion(name, table_names(reader%time_points)))
      end if
   end subroutine read_times

end module emcon_deck_output
