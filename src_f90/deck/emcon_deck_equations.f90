!> *EQUATION: sums of coefficient times displacement that are zero, until a step removes them.
module emcon_deck_equations
   use emcon_couplings, only : equation_t
   use emcon_deck_dimension, only : freedoms_text, n_plane
   use emcon_deck_fields, only : check_count, data_error, data_open, data_t, get_integer, &
      get_name, get_real, is_blank, is_label, next_line
   use emcon_deck_named, only : get_nodes
   use emcon_deck_reader, only : card_error, card_t, has_option, line_origin, option_name, reader_t
   use emcon_deck_turned, only : turn_equation
   use emcon_diagnostics, only : add_error, quoted
   use emcon_kinds, only : wp
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_sort, only : sort_order
   use emcon_text, only : to_text
   use emcon_turned_axes, only : turned_marks
   implicit none
   private
   public :: read_equations

   !> One term as it is written: a node, or the nodes of a set in the order of their labels.
   type :: term_t
      character(len=:), allocatable :: set         !! name of the set; empty: a node
      integer, allocatable :: item(:)
      integer :: dof = 0
      real(wp) :: coefficient = 0.0_wp
   end type term_t

   !> The equation that is being read.
   type :: draft_t
      type(origin_t) :: origin                     !! of the line with the number of its terms
      integer :: n_wanted = 0                      !! terms it is to have; 0: none is open
      integer :: n = 0                             !! terms read
      logical :: is_refused = .false.
      logical :: is_lost = .false.                 !! after an error: wait for the next count
      type(term_t), allocatable :: term(:)
   end type draft_t

   !> The equations while they grow.
   type :: list_t
      integer :: n = 0
      type(equation_t), allocatable :: item(:)
   end type list_t

contains

   !> All *EQUATION cards before the first step.
   subroutine read_equations(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(list_t) :: list
      integer :: i, n_before
      integer, allocatable :: mark(:)

      n_before = reader%log%n_errors
      allocate(list%item(16))
      do i = 1, size(reader%card)
         associate (card => reader%card(i))
            if (card%name /= "EQUATION") cycle
            if (card%step == 0 .and. (has_option(card, "REMOVE") .or. has_option(card, &
               "REMOVEALL"))) then
               call card_error(reader, card, "REMOVE may stand only inside a step")
            else if (card%step == 0) then
               call read_card(reader, card, scene, list)
            else if (has_option(card, "REMOVE") .or. has_option(card, "REMOVEALL")) then
               call remove_equations(reader, card, scene, list)
            else
               call card_error(reader, card, "known but not supported inside a step: equations " &
                  // "hold from the first step on; put it before the first *STEP")
            end if
         end associate
      end do
      scene%equation = list%item(:list%n)
      allocate(mark, source=turned_marks(scene%node%turned, size(scene%node%label)))
      do i = 1, merge(list%n, 0, size(scene%node%turned) > 0)
         call turn_equation(scene%node%turned, mark, scene%n_dim, scene%equation(i))
      end do
      reader%doubt%equations = reader%doubt%equations .or. reader%log%n_errors > n_before
   end subroutine read_equations

   !> REMOVE, REMOVE ALL: equations that no longer hold from the step of the card on, all or those
   !> whose first term is named.
   subroutine remove_equations(reader, card, scene, list)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(list_t), intent(inout) :: list
      type(data_t) :: data
      integer, allocatable :: item(:)
      logical :: is_named(size(scene%node%label)), is_wanted(list%n), is_empty
      integer :: first, last, k

      is_empty = .true.
      is_wanted = has_option(card, "REMOVEALL")
      call data_open(data, card)
      do while (next_line(reader, data))
         is_empty = .false.
         if (has_option(card, "REMOVEALL")) then
            call data_error(reader, data, "REMOVE ALL has no data lines")
            return
         end if
         call check_count(reader, data, 2, 3, "node or node set, first dof, last dof")
         if (data%ok) call get_nodes(reader, data, 1, scene, item)
         if (data%ok) call get_integer(reader, data, 2, "degree of freedom", first)
         last = first
         if (data%ok .and. .not. is_blank(data, 3)) call get_integer(reader, data, 3, &
            "last degree of freedom", last)
         if (.not. data%ok) cycle
         is_named = .false.
         is_named(item) = .true.
         associate (found => [(is_named(list%item(k)%node(1)) .and. list%item(k)%first_dof &
               >= first .and. list%item(k)%first_dof <= last .and. list%item(k)%last_step &
               >= card%step, k = 1, list%n)])
            is_wanted = is_wanted .or. found
            if (.not. (any(found) .or. reader%doubt%equations)) call data_error(reader, data, &
               "no equation that still holds has its first term there")
         end associate
      end do
      if (is_empty .and. .not. has_option(card, "REMOVEALL")) call card_error(reader, card, &
         "which equations is not said: the node and degree of freedom of their first terms")
      where (is_wanted) list%item(:list%n)%last_step = min(list%item(:list%n)%last_step, &
         card%step - 1)
   end subroutine remove_equations

   !> The equations of one card: each a line with the number of terms, then lines of terms.
   subroutine read_card(reader, card, scene, list)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      type(scene_t), intent(in) :: scene
      type(list_t), intent(inout) :: list
      type(data_t) :: data
      type(draft_t) :: draft
      logical :: is_empty

      is_empty = .true.
      allocate(draft%term(4))
      call data_open(data, card)
      do while (next_line(reader, data))
         is_empty = .false.
         if (data%n == 1 .or. draft%n_wanted == 0) then
            if (draft%n_wanted > 0) call tell_missing(reader, draft)
            if (draft%is_lost .and. data%n /= 1) cycle
            call read_count(reader, data, draft)
            reader%doubt%equations = reader%doubt%equations .or. draft%is_lost
         else
            call read_terms(reader, data, scene, draft)
            reader%doubt%equations = reader%doubt%equations .or. draft%is_refused
            if (draft%n < draft%n_wanted) cycle
            if (.not. draft%is_refused) call store_equation(reader, scene, draft, list)
            draft%n_wanted = 0
         end if
      end do
      if (draft%n_wanted > 0) call tell_missing(reader, draft)
      if (is_empty) call card_error(reader, card, "no equation is given")
   end subroutine read_card

   subroutine tell_missing(reader, draft)
      type(reader_t), intent(inout) :: reader
      type(draft_t), intent(in) :: draft

      call add_error(reader%log, draft%origin, "*EQUATION: the equation is to have " &
         // to_text(draft%n_wanted) // " terms, but only " // to_text(draft%n) // " follow")
   end subroutine tell_missing

   !> The line that begins an equation: the number of its terms.
   subroutine read_count(reader, data, draft)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(draft_t), intent(inout) :: draft
      integer :: n_wanted

      n_wanted = 0
      if (data%n > 1) then
         call data_error(reader, data, "expected the number of terms of an equation, alone on " &
            // "its line, found " // quoted(data%text(data%from(1):data%to(data%n))))
      else
         call get_integer(reader, data, 1, "number of terms", n_wanted)
      end if
      draft%is_lost = .not. data%ok
      draft%n_wanted = merge(n_wanted, 0, data%ok)
      draft%n = 0
      draft%is_refused = .false.
      draft%origin = line_origin(reader, data%i_line)
   end subroutine read_count

   !> A line of terms: node or node set, degree of freedom, coefficient, again and again.
   subroutine read_terms(reader, data, scene, draft)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      type(scene_t), intent(in) :: scene
      type(draft_t), intent(inout) :: draft
      integer :: i

      if (mod(data%n, 3) /= 0 .or. data%n == 0) then
         call data_error(reader, data, "expected terms of node or node set, degree of freedom, " &
            // "coefficient; found " // to_text(data%n) // " values")
      else if (draft%n + data%n/3 > draft%n_wanted) then
         call data_error(reader, data, "the equation of line " // to_text(draft%origin%line) &
            // " is to have " // to_text(draft%n_wanted) // " terms; here is term " &
            // to_text(draft%n_wanted + 1))
      end if
      draft%is_lost = .not. data%ok
      if (draft%is_lost) then
         draft%n_wanted = 0
         draft%is_refused = .true.
         return
      end if
      do i = 1, data%n, 3
         data%ok = .true.
         draft%n = draft%n + 1
         if (draft%n > size(draft%term)) call grow_terms(draft%term)
         call read_term(reader, data, i, scene, draft%term(draft%n))
         draft%is_refused = draft%is_refused .or. .not. data%ok
      end do
   end subroutine read_terms

   pure subroutine grow_terms(term)
      type(term_t), allocatable, intent(inout) :: term(:)
      type(term_t), allocatable :: grown(:)

      allocate(grown(2*size(term)))
      grown(:size(term)) = term
      call move_alloc(grown, term)
   end subroutine grow_terms

   !> The term in the fields from `k` on.
   subroutine read_term(reader, data, k, scene, term)
      type(reader_t), intent(inout) :: reader
      type(data_t), intent(inout) :: data
      integer, intent(in) :: k
      type(scene_t), intent(in) :: scene
      type(term_t), intent(out) :: term

      call get_nodes(reader, data, k, scene, term%item)
      term%set = ""
      if (data%ok .and. .not. is_label(data, k)) then
         call get_name(reader, data, k, "node set", term%set)
         term%item = term%item(sort_order(scene%node%label(term%item)))
         if (size(term%item) == 0) call data_error(reader, data, "node set " // quoted(term%set) &
            // " is empty")
      end if
      call get_integer(reader, data, k + 1, "degree of freedom", term%dof)
      if (term%dof == 3 .and. scene%n_dim == n_plane) then
         call data_error(reader, data, "the model is plane: degree of freedom 3 does not exist")
      else if (term%dof > scene%n_dim) then
         call data_error(reader, data, "degree of freedom " // to_text(term%dof) &
            // " does not exist; known: " // freedoms_text(scene%n_dim))
      end if
      if (is_blank(data, k + 2)) call data_error(reader, data, "the coefficient is missing")
      call get_real(reader, data, k + 2, "coefficient", term%coefficient)
   end subroutine read_term

   !> Check the equation that was read, and add it to `list`: once for each node of its sets.
   subroutine store_equation(reader, scene, draft, list)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(draft_t), intent(in) :: draft
      type(list_t), intent(inout) :: list
      type(equation_t) :: new
      character(len=:), allocatable :: fault
      logical :: is_kept(draft%n)
      integer :: i, k

      call set_fault(reader, draft%term(:draft%n), fault)
      is_kept = abs(draft%term(:draft%n)%coefficient) > 0.0_wp
      if (fault == "" .and. .not. any(is_kept)) then
         fault = "all coefficients are 0"
      else if (fault == "" .and. .not. is_kept(1)) then
         fault = "the first coefficient is 0; the first term is the one to eliminate: put " &
            // "another one first"
      end if
      new%origin = draft%origin
      new%dof = draft%term(:draft%n)%dof
      new%coefficient = draft%term(:draft%n)%coefficient
      allocate(new%node(draft%n))
      do i = 1, size(draft%term(1)%item)
         if (fault /= "") exit
         do k = 1, draft%n
            new%node(k) = draft%term(k)%item(min(i, size(draft%term(k)%item)))
         end do
         call repeated_fault(scene, new, fault)
         if (fault == "") call append(list, new, is_kept)
      end do
      if (fault /= "") call add_error(reader%log, draft%origin, "*EQUATION: " // fault)
   end subroutine store_equation

   !> What is wrong with the numbers of nodes of the terms: empty if nothing is.
   !>
   !> The nodes of sets are paired; a single node stands in each of the equations.
   subroutine set_fault(reader, term, fault)
      type(reader_t), intent(in) :: reader
      type(term_t), intent(in) :: term(:)
      character(len=:), allocatable, intent(out) :: fault
      integer :: k, n, n_paired

      fault = ""
      n = size(term(1)%item)
      n_paired = 0
      do k = 1, size(term)
         if (size(term(k)%item) > 1) n_paired = n_paired + 1
         if (size(term(k)%item) == n .or. size(term(k)%item) == 1) cycle
         fault = "node set " // quoted(term(k)%set) // " has " // to_text(size(term(k)%item)) &
            // " nodes, the first term has " // to_text(n) // "; they are paired one by one"
         return
      end do
      if (n_paired < 2) return
      do k = 1, size(term)
         if (.not. is_unsorted(reader, term(k)%set)) cycle
         fault = "node set " // quoted(term(k)%set) // " is UNSORTED, but nodes are paired in " &
            // "the order of their labels; name them one by one"
         return
      end do
   end subroutine set_fault

   !> Whether a card of the node set `name` says that the order of its nodes matters.
   pure logical function is_unsorted(reader, name)
      type(reader_t), intent(in) :: reader
      character(len=*), intent(in) :: name
      integer :: i

      is_unsorted = .false.
      if (name == "") return
      do i = 1, size(reader%card)
         if (reader%card(i)%name /= "NSET") cycle
         if (.not. has_option(reader%card(i), "UNSORTED")) cycle
         if (option_name(reader%card(i), "NSET") == name) is_unsorted = .true.
      end do
   end function is_unsorted

   !> Names a degree of freedom that stands twice in an equation; empty if none does.
   pure subroutine repeated_fault(scene, equation, fault)
      type(scene_t), intent(in) :: scene
      type(equation_t), intent(in) :: equation
      character(len=:), allocatable, intent(out) :: fault
      integer :: freedom(size(equation%node)), order(size(equation%node)), i

      fault = ""
      freedom = scene%n_dim*(equation%node - 1) + equation%dof
      order = sort_order(freedom)
      do i = 2, size(order)
         if (freedom(order(i)) /= freedom(order(i - 1))) cycle
         fault = "degree of freedom " // to_text(equation%dof(order(i))) // " of node " &
            // to_text(scene%node%label(equation%node(order(i)))) // " stands in it twice"
         return
      end do
   end subroutine repeated_fault

   !> Add the terms of `new` that are kept.
   pure subroutine append(list, new, is_kept)
      type(list_t), intent(inout) :: list
      type(equation_t), intent(in) :: new
      logical, intent(in) :: is_kept(:)
      type(equation_t), allocatable :: grown(:)

      if (list%n == size(list%item)) then
         allocate(grown(2*list%n))
         grown(:list%n) = list%item
         call move_alloc(grown, list%item)
      end if
      list%n = list%n + 1
      associate (equation => list%item(list%n))
         equation%origin = new%origin
         equation%node = pack(new%node, is_kept)
         equation%dof = pack(new%dof, is_kept)
         equation%first_dof = equation%dof(1)
         equation%coefficient = pack(new%coefficient, is_kept)
      end associate
   end subroutine append

end module emcon_deck_equations
