!> The kernel tests: `main` runs all, `main SUITE` one suite, `main SUITE TEST` one test.
!>
!> A new suite takes two lines: its `use` and its `call run`. Every test finds the generator of
!> `random_number` in the same state, so a test gives the same figures alone and among others.
program main
   use, intrinsic :: iso_fortran_env, only : output_unit
   use check, only : test_case_t
   use emcon_blas, only : blas_single_thread
   use emcon_errors, only : error_t
   use first_failure, only : failure_take
   use test_active_set, only : collect_active_set
   use test_active_choice, only : collect_active_choice
   use test_arcs, only : collect_arcs
   use test_blas, only : collect_blas
   use test_bulges_space, only : collect_bulges_space
   use test_band_blocks, only : collect_band_blocks
   use test_bodies, only : collect_bodies
   use test_chain, only : collect_chain
   use test_check, only : collect_check
   use test_circles, only : collect_circles
   use test_iterative, only : collect_iterative
   use test_diagonal_blocks, only : collect_diagonal_blocks
   use test_edge_pair, only : collect_edge_pair
   use test_gram_rows, only : collect_gram_rows
   use test_kept_factor, only : collect_kept_factor
   use test_elimination_tree, only : collect_elimination_tree
   use test_contact_slips_space, only : collect_contact_slips_space
   use test_slips_space, only : collect_slips_space
   use test_supernodal, only : collect_supernodal
   use test_condensation, only : collect_condensation
   use test_condition_nodes, only : collect_condition_nodes
   use test_condition_rows, only : collect_condition_rows
   use test_contact_parts, only : collect_contact_parts
   use test_contact_following, only : collect_contact_following
   use test_contact_problem, only : collect_contact_problem
   use test_contact_rounds, only : collect_contact_rounds
   use test_constraints, only : collect_constraints
   use test_contact_scales, only : collect_contact_scales
   use test_condition_reuse, only : collect_condition_reuse
   use test_contact_states, only : collect_contact_states
   use test_step_begin, only : collect_step_begin
   use test_contact_laws, only : collect_contact_laws
   use test_convergence, only : collect_convergence
   use test_correction, only : collect_correction
   use test_corotated, only : collect_corotated
   use test_critical_step, only : collect_critical_step
   use test_csr, only : collect_csr
   use test_damped, only : collect_damped
   use test_dashpot_law, only : collect_dashpot_law
   use test_dgrad, only : collect_dgrad
   use test_dgrad_near, only : collect_dgrad_near
   use test_dgrad_series, only : collect_dgrad_series
   use test_dgrad_space, only : collect_dgrad_space
   use test_dgrad_wide, only : collect_dgrad_wide
   use test_dissipation, only : collect_dissipation
   use test_stabilization, only : collect_stabilization
   use test_elastic_slip, only : collect_elastic_slip
   use test_element, only : collect_element
   use test_element_kinds, only : collect_element_kinds
   use test_element_axial, only : collect_element_axial
   use test_element_places, only : collect_element_places
   use test_element_space, only : collect_element_space
   use test_energy_watch, only : collect_energy_watch
   use test_velocity_jumps, only : collect_velocity_jumps
   use test_velocity_pushes, only : collect_velocity_pushes
   use test_stopping_jump, only : collect_stopping_jump
   use test_impact_jump, only : collect_impact_jump
   use test_near_list, only : collect_near_list
   use test_common_normal, only : collect_common_normal
   use test_corner_tops, only : collect_corner_tops
   use test_blocked_contact, only : collect_blocked_contact
   use test_explicit, only : collect_explicit
   use test_explicit_closed, only : collect_explicit_closed
   use test_facets, only : collect_facets
   use test_facet_gap, only : collect_facet_gap
   use test_facet_groups, only : collect_facet_groups
   use test_facet_values, only : collect_facet_values
   use test_first_touch, only : collect_first_touch
   use test_first_touch_space, only : collect_first_touch_space
   use test_friction, only : collect_friction
   use test_friction_ways, only : collect_friction_ways
   use test_gauss, only : collect_gauss
   use test_holding, only : collect_holding
   use test_host_check, only : collect_host_check
   use test_host_deck, only : collect_host_deck
   use test_host_force, only : collect_host_force
   use test_given_kinds, only : collect_given_kinds
   use test_given_space, only : collect_user_space
   use test_host_lists, only : collect_host_lists
   use test_host_law, only : collect_host_law
   use test_host_sizes, only : collect_host_sizes
   use test_guards, only : collect_guards
   use test_hermite_gap, only : collect_hermite_gap
   use test_independent_rows, only : collect_independent_rows
   use test_host_contact, only : collect_host_contact
   use test_host_step, only : collect_host_step
   use test_initial_contact, only : collect_initial_contact
   use test_interface, only : collect_interface
   use test_interlock, only : collect_interlock
   use test_joints, only : collect_joints
   use test_lapack, only : collect_lapack
   use test_step_overlap, only : collect_step_overlap
   use test_nodal_pull, only : collect_nodal_pull
   use test_judge, only : collect_judge
   use test_law, only : collect_law
   use test_law_points, only : collect_law_points
   use test_law_space, only : collect_law_space
   use test_law_thin, only : collect_law_thin
   use test_ledger, only : collect_ledger
   use test_linear_rows, only : collect_linear_rows
   use test_line_search, only : collect_line_search
   use test_linked_elements, only : collect_linked_elements
   use test_links, only : collect_links
   use test_loads, only : collect_loads
   use test_pressure_law, only : collect_pressure_law
   use test_push_problem, only : collect_push_problem
   use test_press_face, only : collect_press_face
   use test_march, only : collect_march
   use test_march_check, only : collect_march_check
   use test_march_commit, only : collect_march_commit
   use test_march_control, only : collect_march_control
   use test_march_units, only : collect_march_units
   use test_march_contact, only : collect_march_contact
   use test_march_impulse, only : collect_march_impulse
   use test_march_guess, only : collect_march_guess
   use test_march_grid, only : collect_march_grid
   use test_march_parts, only : collect_march_parts
   use test_march_past, only : collect_march_past
   use test_march_snap, only : collect_march_snap
   use test_march_schemes, only : collect_march_schemes
   use test_march_size, only : collect_march_size
   use test_march_kinds, only : collect_march_kinds
   use test_step_control, only : collect_step_control
   use test_mass_return, only : collect_mass_return
   use test_massless, only : collect_massless
   use test_massless_start, only : collect_massless_start
   use test_midside, only : collect_midside
   use test_mortar, only : collect_mortar
   use test_mortar_choice, only : collect_mortar_choice
   use test_mortar_frame, only : collect_mortar_frame
   use test_mortar_pair, only : collect_mortar_pair
   use test_mortar_stencil, only : collect_mortar_stencil
   use test_mortar_wall_gap, only : collect_mortar_wall_gap
   use test_motion_bound, only : collect_motion_bound
   use test_pair_forces, only : collect_pair_forces
   use test_penalty_state, only : collect_penalty_state
   use test_memory, only : collect_memory
   use test_name_index, only : collect_name_index
   use test_near_laws, only : collect_near_laws
   use test_newton, only : collect_newton
   use test_node_potential, only : collect_node_potential
   use test_nts, only : collect_nts
   use test_nts_gap, only : collect_nts_gap
   use test_nts_choice, only : collect_nts_choice
   use test_nts_states, only : collect_nts_states
   use test_nts_stencil, only : collect_nts_stencil
   use test_null_space, only : collect_null_space
   use test_numbering, only : collect_numbering
   use test_outline, only : collect_outline
   use test_patch_contact, only : collect_patch_contact
   use test_patch_gap, only : collect_patch_gap
   use test_overlap_boxes, only : collect_overlap_boxes
   use test_overlap_plane, only : collect_overlap_plane
   use test_overlap_space, only : collect_overlap_space
   use test_passages_space, only : collect_passages_space
   use test_deck_parameters, only : collect_deck_parameters
   use test_deck_ties, only : collect_deck_ties
   use test_point_function, only : collect_point_function
   use test_reduction, only : collect_reduction
   use test_results, only : collect_results
   use test_rigid_motion, only : collect_rigid_motion
   use test_rigidity, only : collect_rigidity
   use test_rigid_pushes, only : collect_rigid_pushes
   use test_rigid_bodies, only : collect_rigid_bodies
   use test_row_elimination, only : collect_row_elimination
   use test_row_order, only : collect_row_order
   use test_lane_sums, only : collect_lane_sums
   use test_mixing, only : collect_mixing
   use test_pushed_rows, only : collect_pushed_rows
   use test_saddle_point, only : collect_saddle_point
   use test_scheme, only : collect_scheme
   use test_search, only : collect_search
   use test_segment, only : collect_segment
   use test_self_contact, only : collect_self_contact
   use test_shape, only : collect_shape
   use test_single_elements, only : collect_single_elements
   use test_stl, only : collect_stl
   use test_stress, only : collect_stress
   use test_soft_law, only : collect_soft_law
   use test_solid, only : collect_solid
   use test_solid_parts, only : collect_solid_parts
   use test_solid_threads, only : collect_solid_threads
   use test_bending, only : collect_bending
   use test_bent_bodies, only : collect_bent_bodies
   use test_solvers, only : collect_solvers
   use test_start_gaps, only : collect_start_gaps
   use test_start_gaps_space, only : collect_start_gaps_space
   use test_touch_rule_space, only : collect_touch_rule_space
   use test_signed_distance, only : collect_signed_distance
   use test_stepper_free, only : collect_stepper_free
   use test_stepper_query, only : collect_stepper_query
   use test_system, only : collect_system
   use test_system_kinds, only : collect_system_kinds
   use test_tangent_factors, only : collect_tangent_factors
   use test_thin_stress, only : collect_thin_stress
   use test_tied_contact, only : collect_tied_contact
   use test_tie, only : collect_tie
   use test_tie_partner, only : collect_tie_partner
   use test_tie_balance, only : collect_tie_balance
   use test_tie_space, only : collect_tie_space
   use test_ties, only : collect_ties
   use test_triple_product, only : collect_triple_product
#ifndef EMCON_PERMISSIVE
   use test_umfpack, only : collect_umfpack
#endif
   use test_quantities, only : collect_quantities
   use test_verdict, only : collect_verdict
   use test_verdict_follow, only : collect_verdict_follow
   use test_turn_space, only : collect_turn_space
   use test_profile_fillet, only : collect_profile_fillet
   use test_wall_gap, only : collect_wall_gap
   use test_velocity_update, only : collect_velocity_update
   implicit none

   abstract interface
      subroutine collect_procedure(tests)
         import :: test_case_t
         implicit none
         type(test_case_t), allocatable, intent(out) :: tests(:)
      end subroutine collect_procedure
   end interface

   character(len=64) :: only_suite, only_test       !! blank: all
   integer :: n_passed, n_failed
   logical :: is_done

   ! As programs do: threads of BLAS would spend most of the time on waiting for each other.
   call blas_single_thread(is_done)
   n_passed = 0
   n_failed = 0
   call get_command_argument(1, only_suite)
   call get_command_argument(2, only_test)

   call run("check", collect_check)
   call run("blas", collect_blas)
   call run("critical_step", collect_critical_step)
   call run("csr", collect_csr)
   call run("edge_pair", collect_edge_pair)
   call run("contact_slips_space", collect_contact_slips_space)
   call run("slips_space", collect_slips_space)
   call run("triple_product", collect_triple_product)
   call run("row_elimination", collect_row_elimination)
   call run("row_order", collect_row_order)
#ifndef EMCON_PERMISSIVE
   call run("umfpack", collect_umfpack)
#endif
   call run("solvers", collect_solvers)
   call run("start_gaps", collect_start_gaps)
   call run("start_gaps_space", collect_start_gaps_space)
   call run("bulges_space", collect_bulges_space)
   call run("touch_rule_space", collect_touch_rule_space)
   call run("signed_distance", collect_signed_distance)
   call run("contact_scales", collect_contact_scales)
   call run("condition_reuse", collect_condition_reuse)
   call run("contact_states", collect_contact_states)
   call run("step_begin", collect_step_begin)
   call run("diagonal_blocks", collect_diagonal_blocks)
   call run("iterative", collect_iterative)
   call run("gram_rows", collect_gram_rows)
   call run("kept_factor", collect_kept_factor)
   call run("elimination_tree", collect_elimination_tree)
   call run("supernodal", collect_supernodal)
   call run("host_contact", collect_host_contact)
   call run("initial_contact", collect_initial_contact)
   call run("lapack", collect_lapack)
   call run("first_touch", collect_first_touch)
   call run("first_touch_space", collect_first_touch_space)
   call run("friction", collect_friction)
   call run("friction_ways", collect_friction_ways)
   call run("dashpot_law", collect_dashpot_law)
   call run("gauss", collect_gauss)
   call run("band_blocks", collect_band_blocks)
   call run("dgrad_near", collect_dgrad_near)
   call run("dgrad_series", collect_dgrad_series)
   call run("dgrad", collect_dgrad)
   call run("dgrad_space", collect_dgrad_space)
   call run("dgrad_wide", collect_dgrad_wide)
   call run("dissipation", collect_dissipation)
   call run("stabilization", collect_stabilization)
   call run("point_function", collect_point_function)
   call run("shape", collect_shape)
   call run("step_overlap", collect_step_overlap)
   call run("nodal_pull", collect_nodal_pull)
   call run("judge", collect_judge)
   call run("law", collect_law)
   call run("law_points", collect_law_points)
   call run("law_space", collect_law_space)
   call run("law_thin", collect_law_thin)
   call run("ledger", collect_ledger)
   call run("elastic_slip", collect_elastic_slip)
   call run("element", collect_element)
   call run("element_kinds", collect_element_kinds)
   call run("element_axial", collect_element_axial)
   call run("element_places", collect_element_places)
   call run("element_space", collect_element_space)
   call run("corotated", collect_corotated)
   call run("single_elements", collect_single_elements)
   call run("soft_law", collect_soft_law)
   call run("stl", collect_stl)
   call run("stress", collect_stress)
   call run("solid", collect_solid)
   call run("solid_parts", collect_solid_parts)
   call run("solid_threads", collect_solid_threads)
   call run("bending", collect_bending)
   call run("bent_bodies", collect_bent_bodies)
   call run("facets", collect_facets)
   call run("facet_gap", collect_facet_gap)
   call run("facet_groups", collect_facet_groups)
   call run("facet_values", collect_facet_values)
   call run("chain", collect_chain)
   call run("search", collect_search)
   call run("segment", collect_segment)
   call run("self_contact", collect_self_contact)
   call run("nts_gap", collect_nts_gap)
   call run("nts_choice", collect_nts_choice)
   call run("nts_states", collect_nts_states)
   call run("nts_stencil", collect_nts_stencil)
   call run("nts", collect_nts)
   call run("interface", collect_interface)
   call run("host_step", collect_host_step)
   call run("interlock", collect_interlock)
   call run("joints", collect_joints)
   call run("host_check", collect_host_check)
   call run("host_deck", collect_host_deck)
   call run("host_force", collect_host_force)
   call run("node_potential", collect_node_potential)
   call run("guards", collect_guards)
   call run("hermite_gap", collect_hermite_gap)
   call run("mass_return", collect_mass_return)
   call run("massless", collect_massless)
   call run("massless_start", collect_massless_start)
   call run("midside", collect_midside)
   call run("mortar_frame", collect_mortar_frame)
   call run("mortar_pair", collect_mortar_pair)
   call run("mortar_stencil", collect_mortar_stencil)
   call run("mortar_wall_gap", collect_mortar_wall_gap)
   call run("motion_bound", collect_motion_bound)
   call run("pair_forces", collect_pair_forces)
   call run("penalty_state", collect_penalty_state)
   call run("mortar", collect_mortar)
   call run("mortar_choice", collect_mortar_choice)
   call run("damped", collect_damped)
   call run("tie", collect_tie)
   call run("tie_partner", collect_tie_partner)
   call run("tie_balance", collect_tie_balance)
   call run("tie_space", collect_tie_space)
   call run("numbering", collect_numbering)
   call run("patch_contact", collect_patch_contact)
   call run("patch_gap", collect_patch_gap)
   call run("turn_space", collect_turn_space)
   call run("profile_fillet", collect_profile_fillet)
   call run("wall_gap", collect_wall_gap)
   call run("outline", collect_outline)
   call run("overlap_boxes", collect_overlap_boxes)
   call run("overlap_plane", collect_overlap_plane)
   call run("overlap_space", collect_overlap_space)
   call run("passages_space", collect_passages_space)
   call run("bodies", collect_bodies)
   call run("arcs", collect_arcs)
   call run("circles", collect_circles)
   call run("linear_rows", collect_linear_rows)
   call run("loads", collect_loads)
   call run("pressure_law", collect_pressure_law)
   call run("push_problem", collect_push_problem)
   call run("press_face", collect_press_face)
   call run("rigid_motion", collect_rigid_motion)
   call run("rigidity", collect_rigidity)
   call run("rigid_pushes", collect_rigid_pushes)
   call run("rigid_bodies", collect_rigid_bodies)
   call run("condensation", collect_condensation)
   call run("condition_nodes", collect_condition_nodes)
   call run("condition_rows", collect_condition_rows)
   call run("contact_parts", collect_contact_parts)
   call run("contact_following", collect_contact_following)
   call run("contact_problem", collect_contact_problem)
   call run("contact_rounds", collect_contact_rounds)
   call run("constraints", collect_constraints)
   call run("contact_laws", collect_contact_laws)
   call run("independent_rows", collect_independent_rows)
   call run("null_space", collect_null_space)
   call run("pushed_rows", collect_pushed_rows)
   call run("tangent_factors", collect_tangent_factors)
   call run("saddle_point", collect_saddle_point)
   call run("lane_sums", collect_lane_sums)
   call run("mixing", collect_mixing)
   call run("convergence", collect_convergence)
   call run("correction", collect_correction)
   call run("reduction", collect_reduction)
   call run("system", collect_system)
   call run("system_kinds", collect_system_kinds)
   call run("linked_elements", collect_linked_elements)
   call run("thin_stress", collect_thin_stress)
   call run("line_search", collect_line_search)
   call run("memory", collect_memory)
   call run("name_index", collect_name_index)
   call run("near_laws", collect_near_laws)
   call run("newton", collect_newton)
   call run("velocity_update", collect_velocity_update)
   call run("quantities", collect_quantities)
   call run("verdict", collect_verdict)
   call run("verdict_follow", collect_verdict_follow)
   call run("scheme", collect_scheme)
   call run("active_set", collect_active_set)
   call run("active_choice", collect_active_choice)
   call run("energy_watch", collect_energy_watch)
   call run("velocity_jumps", collect_velocity_jumps)
   call run("velocity_pushes", collect_velocity_pushes)
   call run("stopping_jump", collect_stopping_jump)
   call run("impact_jump", collect_impact_jump)
   call run("near_list", collect_near_list)
   call run("common_normal", collect_common_normal)
   call run("corner_tops", collect_corner_tops)
   call run("blocked_contact", collect_blocked_contact)
   call run("explicit", collect_explicit)
   call run("explicit_closed", collect_explicit_closed)
   call run("holding", collect_holding)
   call run("march", collect_march)
   call run("march_check", collect_march_check)
   call run("march_commit", collect_march_commit)
   call run("march_control", collect_march_control)
   call run("march_units", collect_march_units)
   call run("march_contact", collect_march_contact)
   call run("march_grid", collect_march_grid)
   call run("march_guess", collect_march_guess)
   call run("march_impulse", collect_march_impulse)
   call run("march_parts", collect_march_parts)
   call run("march_past", collect_march_past)
   call run("march_snap", collect_march_snap)
   call run("march_schemes", collect_march_schemes)
   call run("march_size", collect_march_size)
   call run("march_kinds", collect_march_kinds)
   call run("step_control", collect_step_control)
   call run("ties", collect_ties)
   call run("links", collect_links)
   call run("tied_contact", collect_tied_contact)
   call run("deck_parameters", collect_deck_parameters)
   call run("deck_ties", collect_deck_ties)
   call run("stepper_free", collect_stepper_free)
   call run("stepper_query", collect_stepper_query)
   call run("given_kinds", collect_given_kinds)
   call run("given_space", collect_user_space)
   call run("host_law", collect_host_law)
   call run("host_lists", collect_host_lists)
   call run("host_sizes", collect_host_sizes)
   call run("results", collect_results)

   if (n_passed + n_failed == 0) then
      write(output_unit, "(a)") "no test is called " // trim(only_suite) // " " // trim(only_test)
      n_failed = 1
   end if
   write(output_unit, "(i0, a, i0, a)") n_passed, " passed, ", n_failed, " failed"
   flush(output_unit)
   if (n_failed > 0) stop 1

contains

   !> Run the tests of one suite; one line for the suite, one for each failure.
   subroutine run(suite, collect)
      character(len=*), intent(in) :: suite
      procedure(collect_procedure) :: collect
      type(test_case_t), allocatable :: tests(:)
      type(error_t), allocatable :: error
      character(len=:), allocatable :: message
      integer :: i, n_run, n_bad

      if (only_suite /= " " .and. only_suite /= suite) return
      call collect(tests)
      n_run = 0
      n_bad = 0
      do i = 1, size(tests)
         if (only_test /= " " .and. only_test /= tests(i)%name) cycle
         n_run = n_run + 1
         call seed_random()
         call leave_rubbish()
         call tests(i)%run(error)
         call failure_take(message)
         if (allocated(error) .and. .not. allocated(message)) message = error%message
         if (allocated(message) .eqv. tests(i)%should_fail) cycle
         n_bad = n_bad + 1
         if (allocated(message)) then
            write(output_unit, "(6a)") "   FAILED ", suite, " ", trim(tests(i)%name), ": ", message
         else
            write(output_unit, "(4a)") "   FAILED ", suite, " ", trim(tests(i)%name) &
               // ": passed, but should fail"
         end if
      end do
      if (n_run == 0) return
      write(output_unit, "(a, t24, i4, a, i4, a)") suite, n_run - n_bad, " passed", n_bad, " failed"
      flush(output_unit)
      n_passed = n_passed + n_run - n_bad
      n_failed = n_failed + n_bad
   end subroutine run

   !> Fill the stack that the next call uses: what a procedure reads before it is set is then wrong,
   !> not a lucky zero.
   subroutine leave_rubbish()
      integer, volatile :: rubbish(100000)

      rubbish = int(z"7f7f7f7f")
   end subroutine leave_rubbish

   subroutine seed_random()
      integer, allocatable :: seed(:)
      integer :: i, n

      call random_seed(size=n)
      allocate(seed(n))
      do i = 1, n
         seed(i) = 7919*i
      end do
      call random_seed(put=seed)
   end subroutine seed_random

end program main
