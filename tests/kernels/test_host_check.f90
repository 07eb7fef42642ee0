!> What is given and does not fit: patterns, mass, and the order of calls.
module test_host_check
   use, intrinsic :: ieee_arithmetic, only : ieee_quiet_nan, ieee_value
   use check, only : check_error, check_true, test_case_t
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t
   use emcon_solver_registry, only : solver_default, solver_names, solver_user
   use emcon_stepper, only : stepper_build, stepper_close, stepper_t
   use emcon_stepper_user, only : stepper_give_force, stepper_give_mass
   use given_hosts, only : chain_host_init, chain_host_t
   use given_scenes, only : lump, make_line, open_given
   use small_scenes, only : clamp
   implicit none
   private
   public :: collect_host_check

contains

   subroutine collect_host_check(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("wrong patterns", test_patterns), &
         test_case_t("wrong mass", test_mass), &
         test_case_t("wrong order of calls", test_order_of_calls)]
   end subroutine collect_host_check

   subroutine test_patterns(error)
      type(error_t), allocatable, intent(out) :: error
      type(chain_host_t) :: chain, bad
      type(scene_t) :: scene

      call make_line(scene, 3, .false., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2, 3], 4, error)
      if (allocated(error)) return
      call refuse(chain, "has 8 rows and 8 columns, not those of 2 freedoms for each of 3 nodes")
      call chain_host_init(chain, [1, 2, 3], 3, error)
      bad = chain
      bad%pattern%n_col = 8
      call refuse(bad, "has 6 rows and 8 columns, not those of 2 freedoms for each of 3 nodes")
      bad = chain
      bad%pattern%column(1) = 6
      call refuse(bad, "column 6 in row 1 is not in 0..5")
      bad = chain
      bad%pattern%column(1:2) = chain%pattern%column([2, 1])
      call refuse(bad, "column 0 in row 1")
      bad = chain
      bad%pattern%row_start(7) = 5
      call refuse(bad, "its row starts run from 0 to 5, not from 0 to 7")
      bad = chain
      bad%pattern%row_start(3) = 7
      call refuse(bad, "row 3 ends before it begins")
      bad = chain
      deallocate(bad%pattern%column)
      call refuse(bad, "has no rows")
      bad = chain
      bad%pattern%row_start = [0, 7]
      call refuse(bad, "has 2 row starts, not 7")

   contains

      subroutine refuse(host, text)
         type(chain_host_t), intent(in) :: host
         character(len=*), intent(in) :: text
         type(stepper_t) :: stepper
         type(error_t), allocatable :: raised

         stepper%scene = scene
         stepper%is_read = .true.
         call stepper_give_force(stepper, host, raised)
         call check_error(error, raised, err_input, text, "pattern")
         call check_true(error, .not. allocated(stepper%host%force), "nothing was given")
      end subroutine refuse

   end subroutine test_patterns

   subroutine test_mass(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(csr_t) :: mass, bad
      integer, allocatable :: slot(:)

      call make_line(scene, 2, .false., 0.1_wp, 100)
      call csr_from_elements(mass, 2, [1, 3], [1, 2], slot, error)
      if (allocated(error)) return
      mass%value = [2.0_dp, 1.0_dp, 1.0_dp, 2.0_dp]
      call refuse(mass, "")
      bad = mass
      bad%value(2) = 1.5_dp
      call refuse(bad, "between nodes 10 and 20 is not that of the other way round: 1.5, 1")
      bad%value = 2.0_dp                         ! as large as it may be
      call refuse(bad, "")
      bad = mass
      bad%value(2:3) = [1.0_dp, 1.5_dp]
      call refuse(bad, "between nodes 10 and 20 is not that of the other way round: 1, 1.5")
      bad = mass
      bad%value(4) = -2.0_dp
      call refuse(bad, "between nodes 10 and 20 is larger than")
      bad%value(2:3) = 0.0_dp
      call refuse(bad, "between nodes 20 and 20 is negative")
      bad%value(1) = real(ieee_value(1.0_wp, ieee_quiet_nan), dp)
      call refuse(bad, "is not finite")
      deallocate(bad%value)
      call refuse(bad, "has no values")
      call lump(bad, 3, 1.0_wp)
      call refuse(bad, "has 3 rows and 3 columns, not those of 2 nodes")

   contains

      subroutine refuse(matrix, text)
         type(csr_t), intent(in) :: matrix
         character(len=*), intent(in) :: text
         type(stepper_t) :: stepper
         type(error_t), allocatable :: raised

         stepper%scene = scene
         stepper%is_read = .true.
         call stepper_give_mass(stepper, matrix, raised)
         if (text == "") then
            call check_true(error, .not. allocated(raised), "a good mass")
         else
            call check_error(error, raised, err_input, text, "mass")
         end if
      end subroutine refuse

   end subroutine test_mass

   subroutine test_order_of_calls(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(stepper_t) :: empty, massless, linked, loose, unsolved, stepper
      character(len=:), allocatable :: known
      type(chain_host_t) :: chain
      type(csr_t) :: mass

      call make_line(scene, 2, .false., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      call stepper_give_force(empty, chain, raised)
      call check_error(error, raised, err_input, "no deck was read", "before reading")
      empty%scene = scene
      empty%is_read = .true.
      call stepper_build(empty, raised)
      call check_error(error, raised, err_input, "no elements, and no forces", "nothing at all")
      empty%scene = scene
      empty%is_read = .true.
      empty%scene%host%node = [1, 2]
      call stepper_build(empty, raised)
      call check_error(error, raised, err_input, "no forces were given", "nothing given")
      call open_given(massless, scene, chain, 0.0_wp, raised)
      call check_error(error, raised, err_input, "node 10 has given forces but no mass", "no mass")
      call make_line(scene, 3, .true., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2], 3, error)
      if (allocated(error)) return
      scene%host%node = [1, 2]
      call clamp(scene%step(1), [1, 2, 3])
      call open_given(linked, scene, chain, 0.0_wp, error)
      if (allocated(error)) return
      call stepper_close(linked)
      scene%step(1)%solution%solver = solver_user
      scene%step(1)%solution%solver_name = "NOBODY"
      call open_given(unsolved, scene, chain, 0.0_wp, raised)
      call check_error(error, raised, err_input, "SOLVER=NOBODY: no program has given this " &
         // "solver, see docs/embedding.md; those of EMCON are ", "a solver that is not there")
      call solver_names(known)
      if (allocated(raised)) call check_true(error, index(raised%message, known) > 0, &
         raised%message)
      scene%step(1)%solution%solver = solver_default
      scene%host%node = [1, 3]
      call open_given(loose, scene, chain, 0.0_wp, raised)
      call check_error(error, raised, err_input, "names node 30, which has neither forces nor " &
         // "mass", "of a node without a spring")
      call make_line(scene, 2, .false., 0.1_wp, 100)
      call chain_host_init(chain, [1, 2], 2, error)
      if (allocated(error)) return
      scene%host%node = [1, 2]
      call open_given(stepper, scene, chain, 1.0_wp, error)
      if (allocated(error)) return
      call stepper_give_force(stepper, chain, raised)
      call check_error(error, raised, err_input, "before the model is built", "after building")
      call lump(mass, 2, 1.0_wp)
      call stepper_give_mass(stepper, mass, raised)
      call check_error(error, raised, err_input, "before the model is built", "after building")
      call stepper_close(stepper)
   end subroutine test_order_of_calls

end module test_host_check
