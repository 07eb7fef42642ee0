!> All that a Fortran program needs of EMCON: `use emcon_api, only : ...` and nothing else.
!>
!> Handles are derived types that the program owns: any number live side by side, each used from one
!> thread at a time. What can fail has `type(error_t), allocatable, intent(out) :: error`: allocated
!> means failed, with `error%code` (0 never; the exit codes of the program) and `error%message`.
!> Reals have the kind `wp`, matrices are `csr_t` with the indices counted from 0. Nodes, steps and
!> constraints are counted from 1; labels are those of the deck. Fields are (2, n_node).
!>
!> **A model and its steps.** In this order:
!>
!> 1. `stepper_open`: read a deck, with parameters as `string_t("NAME=VALUE")`, and build its model;
!>    or `stepper_read`, or for a deck in memory `stepper_read_text` (one text is the passage
!>    `[passage_t()]`), then `stepper_build`. After a failure
!>    `stepper%diagnostic` holds all that is wrong with the deck. What a deck cannot say is given
!>    between reading and building: by `stepper_give_law` and `stepper_give_potential` an energy at
!>    points, a type that extends `point_function_t`, or a law of the invariants of strain, one
!>    that extends `law_t` of `emcon_law`; by `stepper_give_element` the shape of elements, a type
!>    that extends `shape_t`; by `stepper_give_scheme` a scheme of time integration,
!>    a type that extends `scheme_t`; by `stepper_give_force` and `stepper_give_mass` the solid of
!>    a host code, a type that extends `host_force_t`; by `stepper_give_constraint` conditions that
!>    always hold, a type that extends `constraint_t`; by `stepper_give_contact` the contact of a
!>    pair, a type that extends `host_contact_t`; by `stepper_give_contact_law` a law of contact in
!>    place of the penalty, one that extends `contact_law_t`; by `stepper_give_solver` a direct
!>    solver, a type that extends `sparse_solver_t`.
!> 2. `stepper_advance` until `stepper_is_done`: the grid of the deck. Or `stepper_step` with sizes
!>    of the program's own, and `stepper_next_step` for the next step of the deck.
!> 3. Between steps read `stepper%march%state` (`state_t`) and `stepper%march%ledger` (`ledger_t`),
!>    `node_quantity`, `element_quantity`, `contact_quantity`, `pair_quantity`; put a state in by
!>    `stepper_set_state`; go back by `stepper_snapshot` and `stepper_restore`; change loads by
!>    `stepper_find_load`, `stepper_set_load`, `stepper_add_loads`, and boundary values by
!>    `stepper_set_prescribed`, `stepper_add_prescribed`, `stepper_prescribe`,
!>    `stepper_remove_prescribed`.
!> 4. To a file: `stepper_save`, `conditions_exchange`, `restart_write`; back into a new stepper:
!>    `restart_read`, `stepper_load`, `conditions_exchange`.
!> 5. `stepper_close`, also after an error, before the stepper goes.
!>
!> **What the engine computes for a step.** A `query_t` beside the stepper; asking changes nothing.
!> `query_guess` for displacements u1, `query_evaluate`, then of that evaluation `query_residual`,
!> `query_tangent`, `query_null_space`, `query_multipliers`. At any time `query_mass`,
!> `query_momenta`, `query_unknowns`, `query_links`, and `query_constraints` with
!> `query_curvature_times`. After a change of conditions `query_follow`; last `query_free`.
!>
!> **Contact and ties for a program that has its own solids.** In place of a deck: `stepper_new`,
!> `stepper_add_surface`, in space `stepper_add_faces`, `stepper_add_pair` (options:
!> `contact_options_t`), `stepper_add_tie`, `stepper_hold`, `stepper_set_contact`, then
!> `stepper_build`. `query_solve_step` makes a whole step with the solver of the program, a type
!> that extends `host_solver_t`. Or call one by one: `query_begin_contact`; then, until
!> `query_update_active` is done, `query_select` or `query_choose`, and Newton's method on
!> `query_contact`, `query_curvature`, with the multipliers or with `query_null_space`,
!> `query_particular`, `query_multipliers`. Pressures
!> are multipliers over `query_areas`; `query_overlap` judges the step by geometry alone. Friction
!> is that of `interaction_t`, given with the pair; in dynamic steps `query_begin_friction` brings
!> velocities along surfaces to rest, and `query_slips` tells what slides. For friction of any size
!> solve with `query_select_candidates` and `query_solve_contacts`. `query_set_map`: gradients by
!> other unknowns than displacements of the nodes. `query_pattern`: what contact may couple.
!> Damping, given with the pair too, needs `query_begin_damping`; its forces are `query_law_forces`.
module emcon_api
   use emcon_contact, only : gap_state_t
   use emcon_contact_law, only : contact_law_t, contact_place_t, contact_values_t
   use emcon_constraint, only : condition_t, constraint_t, contact_response_t
   use emcon_csr, only : csr_from_elements, csr_from_entries, csr_from_values, csr_multiply, &
      csr_multiply_transposed, csr_t, csr_transpose
   use emcon_csr_product, only : csr_product
   use emcon_deck_source, only : passage_t
   use emcon_errors, only : err_analysis, err_file, err_input, err_internal, err_interrupt, &
      err_none, error_t
   use emcon_host_contact, only : host_contact_t
   use emcon_host_force, only : force_response_t, host_failed, host_force_t, host_ok, &
      host_outside
   use emcon_interactions, only : contact_damping_t, contact_options_t, contact_pair_t, &
      formulation_mortar, &
      formulation_nts, formulation_segment, integration_elements, integration_segments, &
      interaction_t, multiplier_dual, multiplier_standard, normal_edge, normal_nodal, &
      smoothing_hermite, smoothing_none
   use emcon_overlap_check, only : overlap_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t
   use emcon_motion, only : motion_t
   use emcon_point_function, only : point_failed, point_function_t, point_ok, point_outside
   use emcon_evaluation, only : instant_later, instant_t, evaluation_moving, evaluation_t
   use emcon_quantities, only : contact_field, contact_quantity, element_quantity, &
      node_quantity, pair_quantity, quantity_components, quantity_values, quantity_variables
   use emcon_quantity_registry, only : at_contacts, at_elements, at_nodes, at_pairs
   use emcon_restart, only : restart_read, restart_t, restart_write
   use emcon_scene, only : scene_t
   use emcon_scheme, only : scheme_t
   use emcon_shape, only : shape_t
   use emcon_sparse_solver, only : matrix_definite, matrix_general, matrix_symmetric, &
      sparse_solver_t
   use emcon_state, only : state_t
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, &
      stepper_fraction, stepper_is_done, stepper_open, stepper_read, &
      stepper_read_text, stepper_set_threads, stepper_t
   use emcon_stepper_conditions, only : conditions_exchange, stepper_add_prescribed, &
      stepper_prescribe, stepper_remove_prescribed, &
      stepper_set_prescribed
   use emcon_stepper_contact, only : query_areas, query_begin_contact, query_begin_damping, &
      query_begin_friction, query_choose, query_contact, query_drop, query_gaps, &
      query_law_forces, query_overlap, query_select, &
      query_slips, query_update_active, &
      step_cycling, step_done, step_stands_off, step_too_far
   use emcon_stepper_file, only : stepper_load, stepper_save
   use emcon_stepper_free, only : snapshot_t, stepper_next_step, stepper_restore, &
      stepper_set_state, stepper_snapshot, stepper_step
   use emcon_stepper_user, only : stepper_give_constraint, stepper_give_contact, &
      stepper_give_contact_law, stepper_give_element, stepper_give_force, stepper_give_law, &
      stepper_give_mass, stepper_give_potential, stepper_give_scheme, stepper_give_solver
   use emcon_stepper_host, only : stepper_add_faces, stepper_add_pair, stepper_add_surface, &
      stepper_add_tie, stepper_hold, stepper_new, stepper_set_contact, stepper_tie_matrices
   use emcon_stepper_loads, only : stepper_add_loads, stepper_find_load, stepper_set_load
   use emcon_stepper_null_space, only : query_follow_links, query_gather_links, query_links, &
      query_multipliers, query_null_space, query_particular, query_row_multipliers
   use emcon_stepper_problem, only : query_select_candidates, query_solve_contacts
   use emcon_stepper_query, only : query_evaluate, query_follow, query_free, query_guess, &
      query_mass, query_momenta, query_residual, query_t, query_tangent, query_unknowns
   use emcon_stepper_report, only : contact_report_t, query_constraints, query_curvature, &
      query_curvature_times, query_pattern, query_set_map
   use emcon_stepper_solve, only : host_solver_t, query_solve_step
   use emcon_steps, only : initiation_admissible, initiation_persistent, load_gravity, load_point, &
      load_pressure
   use emcon_text, only : string_t
   use emcon_version, only : precision_names, this_precision, version
   implicit none
   public
end module emcon_api
