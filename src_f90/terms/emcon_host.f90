!> What a model is given from outside between reading its deck and building it.
module emcon_host
   use emcon_constraint, only : constraint_box_t, constraint_t
   use emcon_contact_law, only : contact_law_t
   use emcon_csr, only : csr_t
   use emcon_host_contact, only : host_contact_box_t, host_contact_t
   use emcon_host_force, only : host_force_box_t, host_force_t
   use emcon_host_law, only : host_law_t
   use emcon_law, only : law_t
   use emcon_point_function, only : point_function_t
   use emcon_sparse_solver, only : solver_box_t, sparse_solver_t
   implicit none
   private
   public :: host_t, host_add_constraint, host_add_contact, host_add_force, host_add_law, &
      host_add_solver, host_copy_solvers, host_count, host_find_contact, host_find_solver, n_counted

   !> Laws by the names of materials, forces between nodes, mass beside that of elements, solvers
   !> by what decks call them, constraints that always hold, contact of pairs, a law of contact that
   !> gives way.
   type :: host_t
      type(host_law_t), allocatable :: law(:)
      type(host_force_box_t), allocatable :: force(:)
      type(csr_t) :: mass                        !! (n_node x n_node) [M]; without rows: none
      type(solver_box_t), allocatable :: solver(:)
      type(constraint_box_t), allocatable :: constraint(:)
      type(host_contact_box_t), allocatable :: contact(:)
      class(contact_law_t), allocatable :: contact_law
   end type host_t

   !> What `host_count` counts.
   integer, parameter :: n_counted = 4

contains

   !> Append a copy of `force`.
   subroutine host_add_force(self, force)
      type(host_t), intent(inout) :: self
      class(host_force_t), intent(in) :: force
      type(host_force_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%force)) n = size(self%force)
      allocate(longer(n + 1))
      do i = 1, n
         call move_alloc(self%force(i)%force, longer(i)%force)
      end do
      allocate(longer(n + 1)%force, source=force)
      call move_alloc(longer, self%force)
   end subroutine host_add_force

   !> Append a copy of `constraint`, whose conditions hold at the end of every step.
   subroutine host_add_constraint(self, constraint)
      type(host_t), intent(inout) :: self
      class(constraint_t), intent(in) :: constraint
      type(constraint_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%constraint)) n = size(self%constraint)
      allocate(longer(n + 1))
      do i = 1, n
         call move_alloc(self%constraint(i)%constraint, longer(i)%constraint)
      end do
      allocate(longer(n + 1)%constraint, source=constraint)
      call move_alloc(longer, self%constraint)
   end subroutine host_add_constraint

   !> Append a copy of `contact`, the formulation of pair `pair`.
   subroutine host_add_contact(self, pair, contact)
      type(host_t), intent(inout) :: self
      integer, intent(in) :: pair                !! of the scene
      class(host_contact_t), intent(in) :: contact
      type(host_contact_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%contact)) n = size(self%contact)
      allocate(longer(n + 1))
      do i = 1, n
         longer(i)%pair = self%contact(i)%pair
         call move_alloc(self%contact(i)%contact, longer(i)%contact)
      end do
      longer(n + 1)%pair = pair
      allocate(longer(n + 1)%contact, source=contact)
      call move_alloc(longer, self%contact)
   end subroutine host_add_contact

   !> The place of the formulation of pair `pair`; 0: it was not given.
   pure integer function host_find_contact(self, pair) result(k)
      type(host_t), intent(in) :: self
      integer, intent(in) :: pair                !! of the scene

      k = 0
      if (allocated(self%contact)) k = findloc(self%contact%pair, pair, 1)
   end function host_find_contact

   !> Numbers of forces, of masses, of conditions of all constraints, of laws of contact: what a run
   !> without them would go on without a word.
   pure function host_count(self) result(n)
      type(host_t), intent(in) :: self
      integer :: n(n_counted)
      integer :: i

      n = [0, merge(1, 0, self%mass%n_row > 0), 0, merge(1, 0, allocated(self%contact_law))]
      if (allocated(self%force)) n(1) = size(self%force)
      if (.not. allocated(self%constraint)) return
      do i = 1, size(self%constraint)
         n(3) = n(3) + self%constraint(i)%constraint%n_constraint
      end do
   end function host_count

   !> Append a copy of the strain energy, or of the law, of the material `name`.
   subroutine host_add_law(self, name, energy, law)
      type(host_t), intent(inout) :: self
      character(len=*), intent(in) :: name       !! as in `material_t`
      class(point_function_t), intent(in), optional :: energy
      class(law_t), intent(in), optional :: law   !! one of the two is there
      type(host_law_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%law)) n = size(self%law)
      allocate(longer(n + 1))
      do i = 1, n
         longer(i)%material = self%law(i)%material
         call move_alloc(self%law(i)%energy, longer(i)%energy)
         call move_alloc(self%law(i)%law, longer(i)%law)
      end do
      longer(n + 1)%material = name
      if (present(energy)) allocate(longer(n + 1)%energy, source=energy)
      if (present(law)) allocate(longer(n + 1)%law, source=law)
      call move_alloc(longer, self%law)
   end subroutine host_add_law

   !> Append a copy of a solver that has not been used.
   subroutine host_add_solver(self, name, solver)
      type(host_t), intent(inout) :: self
      character(len=*), intent(in) :: name       !! upper case, without blanks
      class(sparse_solver_t), intent(in) :: solver   !! it has analysed nothing yet
      type(solver_box_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(self%solver)) n = size(self%solver)
      allocate(longer(n + 1))
      do i = 1, n
         longer(i)%name = self%solver(i)%name
         call move_alloc(self%solver(i)%solver, longer(i)%solver)
      end do
      longer(n + 1)%name = name
      allocate(longer(n + 1)%solver, source=solver)
      call move_alloc(longer, self%solver)
   end subroutine host_add_solver

   !> Place of the solver `name` in a list; 0: it is not there.
   pure integer function host_find_solver(solver, name) result(i)
      type(solver_box_t), intent(in) :: solver(:)   !! each with its name
      character(len=*), intent(in) :: name       !! upper case, without blanks

      do i = size(solver), 1, -1
         if (solver(i)%name == name) return
      end do
   end function host_find_solver

   !> The solvers of `self`, independent of it; none: of no size.
   subroutine host_copy_solvers(self, copy)
      type(host_t), intent(in), optional :: self
      type(solver_box_t), allocatable, intent(out) :: copy(:)   !! each with its name
      integer :: i, n

      n = 0
      if (present(self)) then
         if (allocated(self%solver)) n = size(self%solver)
      end if
      allocate(copy(n))
      do i = 1, n
         copy(i)%name = self%solver(i)%name
         allocate(copy(i)%solver, source=self%solver(i)%solver)
      end do
   end subroutine host_copy_solvers

end module emcon_host
