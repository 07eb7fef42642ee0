!> What a model is given: lists that keep what was given before, in order, and copies.
module test_host_lists
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_contact_law_registry, only : contact_law_of_method
   use emcon_errors, only : error_t
   use emcon_host, only : host_add_constraint, host_add_force, host_add_law, host_add_solver, &
      host_copy_solvers, host_count, host_find_solver, host_t
   use emcon_kinds, only : wp
   use emcon_linear_conditions, only : linear_conditions_init, linear_conditions_t
   use emcon_linear_rows, only : linear_rows_t
   use emcon_solver_registry, only : solver_create, solver_default
   use emcon_sparse_solver, only : matrix_general, solver_box_t, sparse_solver_t
   use emcon_steps, only : method_penalty
   use given_hosts, only : chain_host_init, chain_host_t, well_t
   use given_scenes, only : lump
   use linear_scenes, only : begin_rows, put_row
   implicit none
   private
   public :: collect_host_lists

contains

   subroutine collect_host_lists(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("numbers of what was given", test_counts), &
         test_case_t("laws and solvers by their names", test_names)]
   end subroutine collect_host_lists

   !> Three forces and constraints of one to three conditions, a mass, a law of contact.
   subroutine test_counts(error)
      type(error_t), allocatable, intent(out) :: error
      type(host_t) :: host
      type(chain_host_t) :: chain
      type(linear_rows_t) :: rows
      type(linear_conditions_t) :: conditions
      integer :: k

      call check_equal(error, host_count(host), [0, 0, 0, 0], "nothing yet")
      call begin_rows(rows)
      do k = 1, 3
         call chain_host_init(chain, [1, 2], 2, error)
         if (allocated(error)) return
         chain%k = real(k, wp)
         call host_add_force(host, chain)
         call put_row(rows, 2*k, [2*k - 1, 2*k], [1.0_wp, -1.0_wp])
         call linear_conditions_init(conditions, rows)
         call host_add_constraint(host, conditions)
      end do
      call check_equal(error, host_count(host), [3, 0, 1 + 2 + 3, 0], "given")
      do k = 1, 3
         select type (force => host%force(k)%force)
         type is (chain_host_t)
            call check_near(error, force%k, real(k, wp), 0.0_wp, 1.0_wp, "force")
         class default
            call check_true(error, .false., "a force of its own kind")
         end select
         call check_equal(error, host%constraint(k)%constraint%n_constraint, k, "constraint")
      end do
      call lump(host%mass, 2, 1.0_wp)
      call contact_law_of_method(method_penalty, host%contact_law)
      call check_equal(error, host_count(host), [3, 1, 6, 1], "all kinds")
   end subroutine test_counts

   !> Of solvers with one name the last is found; copies live by themselves.
   subroutine test_names(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=5), parameter :: name(4) = ["FIRST", "OTHER", "THIRD", "FIRST"]
      type(host_t) :: host
      type(solver_box_t), allocatable :: copy(:)
      class(sparse_solver_t), allocatable :: solver
      integer :: k

      call host_copy_solvers(copy=copy)
      call check_equal(error, size(copy), 0, "of nothing")
      call host_copy_solvers(host, copy)
      call check_equal(error, size(copy), 0, "no solver")
      do k = 1, size(name)
         call solver_create(solver_default, matrix_general, solver)
         call host_add_solver(host, name(k), solver)
         call host_add_law(host, name(k), energy=well_t(k=real(k, wp)))
         deallocate(solver)
      end do
      call host_copy_solvers(host, copy)
      deallocate(host%solver)
      call check_equal(error, size(copy), size(name), "copies")
      do k = 1, size(name)
         call check_equal(error, trim(copy(k)%name), name(k), "name of a solver")
         call check_true(error, allocated(copy(k)%solver), "a solver")
         call check_equal(error, trim(host%law(k)%material), name(k), "name of a law")
         select type (energy => host%law(k)%energy)
         type is (well_t)
            call check_near(error, energy%k, real(k, wp), 0.0_wp, 1.0_wp, "law")
         class default
            call check_true(error, .false., "a law of its own kind")
         end select
         call check_true(error, .not. allocated(host%law(k)%law), "one of the two")
      end do
      call check_equal(error, [(host_find_solver(copy, name(k)), k = 1, 3)], [4, 2, 3], "found")
      call check_equal(error, host_find_solver(copy, "NONE"), 0, "not there")
   end subroutine test_names

end module test_host_lists
