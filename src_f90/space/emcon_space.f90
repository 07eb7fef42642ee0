!> Which freedoms a model has, which of them are unknowns of a step, and how the matrix between
!> these is laid out.
module emcon_space
   use emcon_bodies, only : bodies_find_lists
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_linear_rows, only : linear_rows_choose, linear_rows_init, linear_rows_t
   use emcon_numbering, only : numbering_init, numbering_t, unresolved_t
   use emcon_reduction, only : freedom_numbers, reduction_init, reduction_t
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_motions
   use emcon_steps, only : method_saddle_point
   implicit none
   private
   public :: space_t, space_init, space_begin_step
   public :: lists_t, lists_append, lists_alone, lists_begin

   !> Freedoms that meet, list by list; freedom a of node i is n_dim*(i - 1) + a.
   type :: lists_t
      integer :: n_dim = 0
      integer, allocatable :: start(:)           !! (lists + 1) into `freedom`; last: size + 1
      integer, allocatable :: freedom(:)
   end type lists_t

   type :: space_t
      logical, allocatable :: has_motion(:)      !! (n_dim + turns) rigid ones, and so momenta
      integer :: n_body = 0
      integer, allocatable :: body(:)            !! (n_node) connected part; 0: of none
      !> Nodes body by body, those of body b: member(first(b):first(b + 1) - 1)
      integer, allocatable :: first(:), member(:)
      logical, allocatable :: is_alive(:, :)     !! (n_dim, n_node) in a term, a row
      type(linear_rows_t) :: linear              !! rows of rigid bodies, ties and equations
      type(numbering_t) :: linked                !! linear constraints eliminated; if there are any
      type(unresolved_t), allocatable :: unresolved(:)   !! those of them that follow from others
      logical :: is_reduced = .true.             !! `numbering` is that one, else without them
      type(numbering_t) :: numbering
      type(reduction_t) :: reduction             !! brings dependent freedoms into the matrix
   end type space_t

contains

   !> No lists yet, of freedoms of `n_dim` directions.
   pure subroutine lists_begin(self, n_dim)
      type(lists_t), intent(out) :: self
      integer, intent(in) :: n_dim               !! > 0

      self%n_dim = n_dim
      allocate(self%start(1), source=1)
      allocate(self%freedom(0))
   end subroutine lists_begin

   !> Append lists that stand one behind the other in `freedom`.
   pure subroutine lists_append(self, length, freedom)
      type(lists_t), intent(inout) :: self
      integer, intent(in) :: length(:)           !! (lists) number of freedoms of each
      integer, intent(in) :: freedom(:)          !! (sum of them)
      integer, allocatable :: start(:)
      integer :: k, n

      n = size(self%start)
      allocate(start(n + size(length)))
      start(:n) = self%start
      do k = 1, size(length)
         start(n + k) = start(n + k - 1) + length(k)
      end do
      call move_alloc(start, self%start)
      self%freedom = [self%freedom, freedom]
   end subroutine lists_append

   !> Each freedom of the lists in a list of its own: they do not meet.
   pure subroutine lists_alone(self)
      type(lists_t), intent(inout) :: self
      logical :: is_in(maxval([0, self%freedom]))
      integer :: i

      is_in = .false.
      is_in(self%freedom) = .true.
      self%freedom = pack([(i, i = 1, size(is_in))], is_in)
      self%start = [(i, i = 1, size(self%freedom) + 1)]
   end subroutine lists_alone

   !> Bodies, linear rows, and which freedoms are part of the model: those of `lists`, of equations
   !> and of rigid bodies.
   pure subroutine space_init(self, scene, lists)
      type(space_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(lists_t), intent(in) :: lists         !! of all terms
      logical, allocatable :: is_alive(:)
      integer :: i, n_node

      n_node = size(scene%x, 2)
      self%has_motion = scene_motions(scene)
      call linear_rows_init(self%linear, scene)
      call bodies_find_lists(lists%start, (lists%freedom - 1)/lists%n_dim + 1, n_node, self%body, &
         self%n_body)
      call list_members(self)
      allocate(is_alive(lists%n_dim*n_node), source=.false.)
      is_alive(lists%freedom) = .true.
      do i = 1, size(scene%equation)
         associate (equation => scene%equation(i))
            is_alive(lists%n_dim*(equation%node - 1) + equation%dof) = .true.
         end associate
      end do
      self%is_alive = reshape(is_alive, [lists%n_dim, n_node])
      do i = 1, size(scene%rigid)
         self%is_alive(:, scene%rigid(i)%node) = .true.
         if (allocated(scene%rigid(i)%arm)) self%is_alive(:, scene%rigid(i)%arm) = .true.
      end do
      self%is_alive(:, tie_references(scene)) = .true.
      allocate(self%unresolved(0))
   end subroutine space_init

   !> The nodes of each body.
   pure subroutine list_members(self)
      type(space_t), intent(inout) :: self
      integer :: last(self%n_body), b, i

      last = 0
      do i = 1, size(self%body)
         if (self%body(i) > 0) last(self%body(i)) = last(self%body(i)) + 1
      end do
      allocate(self%first(self%n_body + 1), self%member(sum(last)))
      self%first(1) = 1
      do b = 1, self%n_body
         self%first(b + 1) = self%first(b) + last(b)
      end do
      last = self%first(:self%n_body) - 1
      do i = 1, size(self%body)
         if (self%body(i) == 0) cycle
         last(self%body(i)) = last(self%body(i)) + 1
         self%member(last(self%body(i))) = i
      end do
   end subroutine list_members

   !> Number the unknowns of step `i_step` and lay out the matrix between them. Linear constraints
   !> are eliminated, less those that follow from others, unless the step asks for multipliers or
   !> their rows are too long: `is_reduced` tells.
   subroutine space_begin_step(self, scene, i_step, lists, matrix, slot, error)
      type(space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step                      !! from 1
      type(lists_t), intent(in) :: lists                 !! of all terms
      type(csr_t), intent(out) :: matrix                 !! values are zero
      integer, allocatable, intent(out) :: slot(:)       !! places of the lists in it
      type(error_t), allocatable, intent(out) :: error
      logical :: is_too_full

      associate (step => scene%step(i_step))
         call linear_rows_choose(self%linear, scene, i_step)
         if (any(self%linear%is_gone)) call retire(self, scene, i_step, lists)
         if (self%linear%n > 0) then
            call numbering_init(self%linked, self%is_alive, step%prescribed, self%linear, &
               self%unresolved)
            self%linear%is_used(self%unresolved%row) = .false.
         end if
         self%is_reduced = step%contact%method /= method_saddle_point
      end associate
      if (self%is_reduced .and. self%linear%n > 0) then
         self%numbering = self%linked
         call lay_out(self, lists, matrix, slot, is_too_full, error)
         self%is_reduced = .not. is_too_full
         if (allocated(error) .or. self%is_reduced) return
      end if
      call numbering_init(self%numbering, self%is_alive, scene%step(i_step)%prescribed)
      call lay_out(self, lists, matrix, slot, is_too_full, error)
   end subroutine space_begin_step

   !> What was part of the model by equations alone is none of it once these no longer hold.
   pure subroutine retire(self, scene, i_step, lists)
      type(space_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step
      type(lists_t), intent(in) :: lists         !! of all terms
      logical :: is_bare(size(self%is_alive))
      integer :: i

      is_bare = .false.
      do i = 1, size(scene%equation)
         if (i_step > scene%equation(i)%last_step) is_bare(freedoms(i)) = .true.
      end do
      do i = 1, size(scene%equation)
         if (i_step <= scene%equation(i)%last_step) is_bare(freedoms(i)) = .false.
      end do
      is_bare(lists%freedom) = .false.
      self%is_alive = self%is_alive .and. .not. reshape(is_bare, shape(self%is_alive))
      do i = 1, size(scene%rigid)
         self%is_alive(:, scene%rigid(i)%node) = .true.
      end do
      self%is_alive(:, tie_references(scene)) = .true.
      if (allocated(scene%host%node)) self%is_alive(:, scene%host%node) = .true.

   contains

      pure function freedoms(k) result(dof)
         integer, intent(in) :: k
         integer :: dof(size(scene%equation(k)%node))

         dof = lists%n_dim*(scene%equation(k)%node - 1) + scene%equation(k)%dof
      end function freedoms

   end subroutine retire

   !> The nodes by whose displacements the translations of ties grow.
   pure function tie_references(scene) result(node)
      type(scene_t), intent(in) :: scene
      integer, allocatable :: node(:)

      node = pack(scene%tie%map%reference, scene%tie%map%reference > 0)
   end function tie_references

   !> The matrix of `numbering`: each freedom meets those of its lists, and itself.
   subroutine lay_out(self, lists, matrix, slot, is_too_full, error)
      type(space_t), intent(inout) :: self
      type(lists_t), intent(in) :: lists
      type(csr_t), intent(out) :: matrix
      integer, allocatable, intent(out) :: slot(:)
      logical, intent(out) :: is_too_full
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: full
      integer, allocatable :: number(:), bare(:)
      logical :: without_density(size(self%is_alive))
      integer :: i

      is_too_full = .false.
      without_density = reshape(self%is_alive, [size(without_density)])
      without_density(lists%freedom) = .false.
      if (size(lists%freedom) == 0) without_density = .false. ! nothing is known to act: no matrix
      bare = pack([(i, i = 1, size(without_density))], without_density)
      allocate(number, source=freedom_numbers(self%numbering))
      associate (numbering => self%numbering, n => size(lists%freedom), &
            n_entry => sum((lists%start(2:) - lists%start(:size(lists%start) - 1))**2))
         call csr_from_elements(full, numbering%n_unknown + numbering%n_dependent, &
            [lists%start, [(n + 1 + i, i = 1, size(bare))]], number([lists%freedom, bare]), slot, &
            error)
         if (allocated(error)) return
         if (size(slot) > n_entry) slot = slot(:n_entry)
      end associate
      call reduction_init(self%reduction, self%numbering, full, matrix, slot, is_too_full)
   end subroutine lay_out

end module emcon_space
