! build: streams
!> Which degrees of freedom are unknowns, which are prescribed, and which follow from others.
!>
!> Every displacement is a sum over unknown and prescribed ones, u = T w with T constant: one term
!> of weight 1, itself, or for a dependent freedom the terms that linear constraints give it.
!> Source: docs/theory.md, section 10.
module emcon_numbering
   use emcon_csr, only : csr_t
   use emcon_kinds, only : dp, hp, wp
   use emcon_linear_rows, only : linear_rows_t
   use emcon_row_elimination, only : elimination_add, elimination_begin, elimination_left, &
      elimination_resolve, row_elimination_t, row_redundant
   use emcon_sort, only : unique_sorted
   use emcon_steps, only : prescribed_t
   implicit none
   private
   public :: numbering_t, numbering_init, numbering_holds, numbering_fixes, &
      pick_unknowns, pick_magnitudes, &
      add_to_dofs
   public :: spread_dependent, gather_dependent, numbering_matrix, numbering_links, unresolved_t

   type :: numbering_t
      integer :: n_unknown = 0
      integer, allocatable :: unknown(:, :)      !! (n_dim, n_node) 1..n_unknown; 0: another kind
      integer, allocatable :: dof(:)             !! (n_unknown) place in an (n_dim, n_node) array
      integer :: n_dependent = 0
      integer, allocatable :: dependent(:)       !! (n_dependent) their places, ascending
      integer, allocatable :: following(:)       !! those of them that follow unknowns
      ! The terms of each freedom, those of freedom d from start(d) + 1 to start(d + 1):
      integer, allocatable :: start(:)           !! (degrees of freedom + 1)
      integer, allocatable :: term(:)            !! place of an unknown or prescribed freedom
      integer, allocatable :: column(:)          !! its unknown; 0: prescribed
      real(wp), allocatable :: weight(:)
   end type numbering_t

   !> A constraint that could not be used: it follows from others. Where it leaves prescribed
   !> freedoms with weights, these have to fulfil it.
   type :: unresolved_t
      integer :: row = 0                         !! of the linear rows
      integer, allocatable :: dof(:)
      real(wp), allocatable :: weight(:)
   end type unresolved_t

   !> The dependent freedoms as sums: terms of sum k from start(k) + 1 to start(k + 1).
   type :: sums_t
      integer, allocatable :: start(:)           !! (sums + 1) from 0
      integer, allocatable :: term(:)            !! place of an unknown or prescribed freedom
      real(hp), allocatable :: weight(:)
   end type sums_t

contains

   !> Number all degrees of freedom that are alive and that `prescribed` does not name: what has
   !> neither an element nor an equation stays where it is. With `linear`, one freedom for each of
   !> its used rows becomes dependent; rows that follow from earlier ones go to `unresolved`.
   subroutine numbering_init(self, is_alive, prescribed, linear, unresolved)
      type(numbering_t), intent(out) :: self
      logical, intent(in) :: is_alive(:, :)      !! (n_dim, n_node)
      type(prescribed_t), intent(in) :: prescribed(:)
      type(linear_rows_t), intent(in), optional :: linear
      type(unresolved_t), allocatable, intent(out), optional :: unresolved(:)
      type(unresolved_t), allocatable :: rest(:)
      type(sums_t) :: sums
      integer :: k

      allocate(self%unknown, source=merge(1, 0, is_alive))
      do k = 1, size(prescribed)
         self%unknown(prescribed(k)%dof, prescribed(k)%node) = 0
      end do
      allocate(self%dependent(0))
      if (present(linear)) then
         call eliminate(self, linear, sums, rest)
         if (present(unresolved)) call move_alloc(rest, unresolved)
      else
         allocate(sums%start(1), sums%term(0), source=0)
         allocate(sums%weight(0))
      end if
      call number_unknowns(self)
      call collect_terms(self, sums)
   end subroutine numbering_init

   !> Find the dependent freedoms and the sums that they are. Unknowns so far are those marked 1.
   subroutine eliminate(self, linear, sums, unresolved)
      type(numbering_t), intent(inout) :: self
      type(linear_rows_t), intent(in) :: linear
      type(sums_t), intent(out) :: sums
      type(unresolved_t), allocatable, intent(out) :: unresolved(:)
      type(row_elimination_t) :: elimination
      integer, allocatable :: dof(:)

      dof = unique_sorted(linear%dof(:linear%start(linear%n + 1)))
      dof = [pack(dof, unknown_of(self, dof) > 0), pack(dof, unknown_of(self, dof) == 0)]
      call eliminate_rows(self, linear, dof, elimination, unresolved)
      call elimination_resolve(elimination, sums%start, sums%term, sums%weight)
      sums%term = dof(sums%term)
      call sort_sums(self, dof, elimination%pivot, sums)
   end subroutine eliminate

   !> Eliminate the used rows, each in the columns of its freedoms.
   subroutine eliminate_rows(self, linear, dof, elimination, unresolved)
      type(numbering_t), intent(in) :: self
      type(linear_rows_t), intent(in) :: linear
      integer, intent(in) :: dof(:)                      !! freedom of each column, unknowns first
      type(row_elimination_t), intent(out) :: elimination
      type(unresolved_t), allocatable, intent(out) :: unresolved(:)
      integer :: column(size(self%unknown)), fate, k, n
      integer, allocatable :: row(:)

      column = 0
      column(dof) = [(k, k = 1, size(dof))]
      row = pack([(k, k = 1, linear%n)], linear%is_used)
      allocate(unresolved(size(row)))
      call elimination_begin(elimination, size(row), size(dof), count(unknown_of(self, dof) > 0))
      n = 0
      do k = 1, size(row)
         associate (from => linear%start(row(k)) + 1, to => linear%start(row(k) + 1))
            call elimination_add(elimination, column(linear%dof(from:to)), &
               real(linear%weight(from:to), hp), real(linear%weight(from:to), hp), &
               column([linear%own(row(k))]), fate)
         end associate
         if (fate /= row_redundant) cycle
         n = n + 1
         unresolved(n)%row = row(k)
         call note_left(elimination, dof, unresolved(n))
      end do
      unresolved = unresolved(:n)
   end subroutine eliminate_rows

   !> The prescribed freedoms that a redundant row, the last one, is left with.
   subroutine note_left(elimination, dof, item)
      type(row_elimination_t), intent(in) :: elimination
      integer, intent(in) :: dof(:)              !! freedom of each column
      type(unresolved_t), intent(inout) :: item
      integer, allocatable :: column(:)
      real(hp), allocatable :: value(:)

      call elimination_left(elimination, column, value)
      item%dof = dof(column)
      item%weight = real(value, wp)
   end subroutine note_left

   !> From sums in the order of the rows to that of the dependent freedoms, which become known as
   !> such.
   subroutine sort_sums(self, dof, pivot, sums)
      type(numbering_t), intent(inout) :: self
      integer, intent(in) :: dof(:)              !! freedom of each column
      integer, intent(in) :: pivot(:)            !! column of each row; 0: none
      type(sums_t), intent(inout) :: sums
      integer :: row(size(self%unknown)), from(size(sums%term)), n_dim, d, i, j
      integer, allocatable :: start(:)

      n_dim = size(self%unknown, 1)
      row = 0
      do i = 1, size(pivot)
         if (pivot(i) > 0) row(dof(pivot(i))) = i
      end do
      self%dependent = pack([(d, d = 1, size(row))], row > 0)
      allocate(start(size(self%dependent) + 1), source=0)
      do i = 1, size(self%dependent)
         d = self%dependent(i)
         associate (first => sums%start(row(d)) + 1, last => sums%start(row(d) + 1))
            start(i + 1) = start(i) + last - first + 1
            from(start(i) + 1:start(i + 1)) = [(j, j = first, last)]
         end associate
         self%unknown(1 + mod(d - 1, n_dim), 1 + (d - 1)/n_dim) = 0
      end do
      call move_alloc(start, sums%start)
      sums%term = sums%term(from)
      sums%weight = sums%weight(from)
   end subroutine sort_sums

   elemental integer function unknown_of(self, dof)
      type(numbering_t), intent(in) :: self
      integer, intent(in) :: dof                 !! place in an (n_dim, n_node) array

      associate (n_dim => size(self%unknown, 1))
         unknown_of = self%unknown(1 + mod(dof - 1, n_dim), 1 + (dof - 1)/n_dim)
      end associate
   end function unknown_of

   !> Numbers for the freedoms marked as unknown, node by node.
   pure subroutine number_unknowns(self)
      type(numbering_t), intent(inout) :: self
      integer :: i, a, k, n_dim

      n_dim = size(self%unknown, 1)
      self%n_unknown = sum(self%unknown)
      allocate(self%dof(self%n_unknown))
      k = 0
      do i = 1, size(self%unknown, 2)
         do a = 1, n_dim
            if (self%unknown(a, i) == 0) cycle
            k = k + 1
            self%unknown(a, i) = k
            self%dof(k) = a + n_dim*(i - 1)
         end do
      end do
   end subroutine number_unknowns

   !> The terms of all freedoms from those of the dependent ones.
   pure subroutine collect_terms(self, sums)
      type(numbering_t), intent(inout) :: self
      type(sums_t), intent(in) :: sums           !! by dependent freedom
      logical, allocatable :: follows(:)
      integer :: d, k, n, t

      self%n_dependent = size(self%dependent)
      n = size(self%unknown) - self%n_dependent + size(sums%term)
      allocate(self%start(size(self%unknown) + 1), self%term(n), source=0)
      allocate(self%weight(n), source=1.0_wp)
      k = 1
      n = 0
      do d = 1, size(self%unknown)
         if (is_dependent(d, k)) then
            do t = sums%start(k) + 1, sums%start(k + 1)
               n = n + 1
               self%term(n) = sums%term(t)
               self%weight(n) = real(sums%weight(t), wp)
            end do
            k = k + 1
         else
            n = n + 1
            self%term(n) = d
         end if
         self%start(d + 1) = n
      end do
      self%column = unknown_of(self, self%term)
      allocate(follows(self%n_dependent))
      do k = 1, self%n_dependent
         associate (from => self%start(self%dependent(k)), to => self%start(self%dependent(k) + 1))
            follows(k) = any(self%column(from + 1:to) > 0)
         end associate
      end do
      self%following = pack(self%dependent, follows)

   contains

      pure logical function is_dependent(d, k)
         integer, intent(in) :: d, k

         is_dependent = k <= self%n_dependent
         if (is_dependent) is_dependent = self%dependent(k) == d
      end function is_dependent

   end subroutine collect_terms

   !> Does freedom `a` of a node follow from no unknown?
   elemental logical function numbering_fixes(self, a, node)
      type(numbering_t), intent(in) :: self
      integer, intent(in) :: a                   !! 1 to n_dim
      integer, intent(in) :: node                !! of the scene

      associate (d => size(self%unknown, 1)*(node - 1) + a)
         numbering_fixes = all(self%column(self%start(d) + 1:self%start(d + 1)) == 0)
      end associate
   end function numbering_fixes

   !> Are all freedoms of a node prescribed, or follow from what is?
   elemental logical function numbering_holds(self, node)
      type(numbering_t), intent(in) :: self
      integer, intent(in) :: node                !! of the scene

      associate (n_dim => size(self%unknown, 1))
         numbering_holds = all(self%column(self%start(n_dim*(node - 1) + 1) + 1: &
            self%start(n_dim*node + 1)) == 0)
      end associate
   end function numbering_holds

   !> T^T field: the forces on the unknowns that the forces `field` on all freedoms amount to.
   pure subroutine pick_unknowns(self, field, vector)
      type(numbering_t), intent(in) :: self
      real(wp), intent(in) :: field(size(self%start) - 1)    !! (n_dim, n_node)
      real(wp), intent(out), contiguous :: vector(:)         !! (n_unknown)

      call pick(self, .false., field, vector)
   end subroutine pick_unknowns

   !> |T|^T field: the same for magnitudes, which do not cancel.
   pure subroutine pick_magnitudes(self, field, vector)
      type(numbering_t), intent(in) :: self
      real(wp), intent(in) :: field(size(self%start) - 1)    !! (n_dim, n_node)
      real(wp), intent(out), contiguous :: vector(:)         !! (n_unknown)

      call pick(self, .true., field, vector)
   end subroutine pick_magnitudes

   !> T^T field, or |T|^T field.
   pure subroutine pick(self, is_magnitude, field, vector)
      type(numbering_t), intent(in) :: self
      logical, intent(in) :: is_magnitude
      real(wp), intent(in), contiguous :: field(:)
      real(wp), intent(out), contiguous :: vector(:)
      real(wp) :: weight
      integer :: k, t

      do k = 1, self%n_unknown
         vector(k) = field(self%dof(k))
      end do
      do k = 1, size(self%following)
         associate (d => self%following(k))
            do t = self%start(d) + 1, self%start(d + 1)
               if (self%column(t) == 0) cycle
               weight = merge(abs(self%weight(t)), self%weight(t), is_magnitude)
               vector(self%column(t)) = vector(self%column(t)) + weight*field(d)
            end do
         end associate
      end do
   end subroutine pick

   !> Add `factor` times T `vector` to `field`, whose dependent entries follow from the others
   !> before and after.
   pure subroutine add_to_dofs(self, vector, factor, field)
      type(numbering_t), intent(in) :: self
      real(wp), intent(in) :: vector(:)                      !! (n_unknown)
      real(wp), intent(in) :: factor
      real(wp), intent(inout) :: field(size(self%start) - 1) !! (n_dim, n_node)
      integer :: k

      do k = 1, self%n_unknown
         field(self%dof(k)) = field(self%dof(k)) + factor*vector(k)
      end do
      call spread(self, self%following, field)
   end subroutine add_to_dofs

   !> T as a matrix: a row for each of the degrees of freedom `dof`, a column for each unknown.
   pure subroutine numbering_matrix(self, dof, matrix)
      type(numbering_t), intent(in) :: self
      integer, intent(in) :: dof(:)                          !! places in an (n_dim, n_node) array
      type(csr_t), intent(out) :: matrix                     !! (size of dof x n_unknown)
      integer :: i, t, n

      matrix%n_row = size(dof)
      matrix%n_col = self%n_unknown
      allocate(matrix%row_start(size(dof) + 1), source=0)
      n = sum(self%start(dof + 1) - self%start(dof))
      allocate(matrix%column(n), matrix%value(n))
      n = 0
      do i = 1, size(dof)
         do t = self%start(dof(i)) + 1, self%start(dof(i) + 1)
            if (self%column(t) == 0) cycle
            n = n + 1
            matrix%column(n) = self%column(t) - 1
            matrix%value(n) = real(self%weight(t), dp)
         end do
         matrix%row_start(i + 1) = n
      end do
      matrix%column = matrix%column(:n)
      matrix%value = matrix%value(:n)
   end subroutine numbering_matrix

   !> The same for all degrees of freedom: displacements from unknowns.
   pure subroutine numbering_links(self, matrix)
      type(numbering_t), intent(in) :: self
      type(csr_t), intent(out) :: matrix                     !! (degrees of freedom x n_unknown)
      integer :: d

      call numbering_matrix(self, [(d, d = 1, size(self%unknown))], matrix)
   end subroutine numbering_links

   !> Dependent entries of a displacement or velocity from those that they follow.
   pure subroutine spread_dependent(self, field)
      type(numbering_t), intent(in) :: self
      real(wp), intent(inout) :: field(size(self%start) - 1) !! (n_dim, n_node)

      call spread(self, self%dependent, field)
   end subroutine spread_dependent

   !> The entries `dependent` from those that they follow.
   pure subroutine spread(self, dependent, field)
      type(numbering_t), intent(in) :: self
      integer, intent(in) :: dependent(:)                    !! their places
      real(wp), intent(inout), contiguous :: field(:)
      real(wp) :: total
      integer :: k, t

      do k = 1, size(dependent)
         associate (d => dependent(k))
            total = 0.0_wp
            do t = self%start(d) + 1, self%start(d + 1)
               total = total + self%weight(t)*field(self%term(t))
            end do
            field(d) = total
         end associate
      end do
   end subroutine spread

   !> Dependent entries of a force go to the freedoms that they follow.
   pure subroutine gather_dependent(self, field)
      type(numbering_t), intent(in) :: self
      real(wp), intent(inout) :: field(size(self%start) - 1) !! (n_dim, n_node)
      integer :: k, t

      do k = 1, self%n_dependent
         associate (d => self%dependent(k))
            do t = self%start(d) + 1, self%start(d + 1)
               field(self%term(t)) = field(self%term(t)) + self%weight(t)*field(d)
            end do
            field(d) = 0.0_wp
         end associate
      end do
   end subroutine gather_dependent

end module emcon_numbering
