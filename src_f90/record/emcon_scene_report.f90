!> What a scene consists of, what of the program it needs and what not, and advice: the head of a
!> log and what `emcon check` prints.
module emcon_scene_report
   use emcon_contact, only : contact_t, gap_state_t
   use emcon_deck_dimension, only : n_plane
   use emcon_gaps, only : gaps_forget, gaps_search
   use emcon_interactions, only : contact_pair_t, pressure_hard
   use emcon_kinds, only : wp
   use emcon_locking, only : locking_advice
   use emcon_massless_surfaces, only : most_moved
   use emcon_motion, only : at_rest, motion_of
   use emcon_options, only : option_text
   use emcon_evaluation, only : evaluation_at_end
   use emcon_report_bodies, only : bodies_find, bodies_rows, body_t
   use emcon_report_row, only : report_row_t, report_rows_t, row_begin, row_put, rows_add
   use emcon_report_surfaces_space, only : report_surfaces
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_steps, only : initiation_massless, initiation_persistent, step_initiation, &
      step_is_dynamic
   use emcon_stepper, only : stepper_t
   use emcon_surface_facets, only : surface_facets
   use emcon_term_registry, only : terms_solid
   use emcon_text, only : to_text
   implicit none
   private
   public :: scene_report

   !> A body so many times stiffer than the softest one hardly deforms.
   real(wp), parameter :: much_stiffer = 100.0_wp
   !> Thinner ones, by their length, bend.
   real(wp), parameter :: compact = 0.5_wp
   !> Waves are not resolved by increments of so many transits.
   real(wp), parameter :: many_transits = 10.0_wp

contains

   !> The report, before the first increment.
   subroutine scene_report(stepper, rows)
      type(stepper_t), intent(inout) :: stepper
      type(report_rows_t), intent(out) :: rows
      type(body_t), allocatable :: body(:)

      call bodies_find(stepper, body)
      call bodies_rows(stepper%scene, body, rows)
      call add_pairs(stepper, rows)
      call report_surfaces(stepper%scene, rows)
      call add_ties(stepper%scene, rows)
      call add_choices(stepper, rows)
      call add_sizes(stepper, rows)
      call add_increment(stepper, body, rows)
      call advise_rigid(body, rows)
      call advise_locking(terms_solid(stepper%march%system%term), body, rows)
      call advise_massless(stepper%scene, body, rows)
   end subroutine scene_report

   !> A row for each pair, as the history counts them.
   subroutine add_pairs(stepper, rows)
      type(stepper_t), intent(inout) :: stepper
      type(report_rows_t), intent(inout) :: rows
      type(gap_state_t), allocatable :: gap(:)
      type(report_row_t) :: row
      logical, allocatable :: is_of(:)
      integer :: p, k

      associate (system => stepper%march%system, scene => stepper%scene, &
            sums => stepper%march%state%sums)
         if (system%n_pair == 0) return
         call gaps_search(system, motion_of(evaluation_at_end, scene%x, stepper%march%state%u, &
            at_rest(scene%x)), gap)
         call gaps_forget(system)
         allocate(is_of(size(gap)))
         do p = 1, size(sums%sum)
            is_of = .false.
            do k = 1, system%n_pair
               if (abs(sums%of_pair(k)) == p) is_of(system%first_constraint(k) + 1: &
                  system%first_constraint(k + 1)) = .true.
            end do
            k = findloc(abs(sums%of_pair) == p, .true., 1)
            call row_begin(row, "pairs", "pair")
            call row_put(row, "number", p, " #")
            call describe_pair(scene, scene%pair(k), row)
            call row_put(row, "constraints", count(is_of), ", # possible constraints")
            is_of = is_of .and. gap%is_near .and. gap%is_over
            if (any(is_of)) then
               call row_put(row, "smallest_gap", minval(gap%gap0, mask=is_of), ", smallest gap #")
            else
               call row_put(row, "smallest_gap", "none near", ", # at the start")
            end if
            call rows_add(rows, row)
         end do
      end associate
   end subroutine add_pairs

   subroutine describe_pair(scene, pair, row)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(report_row_t), intent(inout) :: row
      character(len=:), allocatable :: how

      call row_put(row, "slave", scene%surface(pair%slave)%name, ": #")
      call count_pieces(pair%slave, "slave")
      if (pair%slave == pair%master) then
         call row_put(row, "master", scene%surface(pair%master)%name, " with itself")
      else
         call row_put(row, "master", scene%surface(pair%master)%name, " on #")
         call count_pieces(pair%master, "master")
      end if
      call option_text("formulation", pair%formulation, how)
      call row_put(row, "formulation", how, ", #")
      how = "both"
      if (.not. pair%both_sides) how = "one"
      call row_put(row, "sides", how, "")
      if (pair%interaction%friction > 0.0_wp) call row_put(row, "friction", &
         pair%interaction%friction, ", friction #")
      associate (damping => pair%interaction%damping)
         if (.not. damping%coefficient > 0.0_wp) return
         call row_put(row, "damping", damping%coefficient, ", damping #")
         call row_put(row, "damping_clearance", damping%clearance, " up to a clearance of #")
         call row_put(row, "damping_flat", damping%flat, "")
         call row_put(row, "tangent_fraction", damping%tangent, ", # of it against slip")
      end associate

   contains

      !> How many edges a surface has, in space how many faces.
      subroutine count_pieces(number, side)
         integer, intent(in) :: number           !! of the surface
         character(len=*), intent(in) :: side
         integer, allocatable :: facet(:, :)
         character(len=5) :: what

         what = merge("edges", "faces", scene%n_dim == n_plane)
         call surface_facets(scene, scene%surface(number), facet)
         call row_put(row, side // "_" // what, size(facet, 2), " (# " // what // ")")
      end subroutine count_pieces
   end subroutine describe_pair

   !> A row for each tie.
   subroutine add_ties(scene, rows)
      type(scene_t), intent(in) :: scene
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      integer :: k

      do k = 1, size(scene%tie)
         call row_begin(row, "ties", "tie")
         call row_put(row, "number", k, " #")
         call row_put(row, "slave", scene%surface(scene%tie(k)%slave)%name, ": #")
         call row_put(row, "master", scene%surface(scene%tie(k)%master)%name, " to #")
         call row_put(row, "rows", size(scene%tie(k)%rows%slave), ", # rows for each direction")
         call rows_add(rows, row)
      end do
   end subroutine add_ties

   !> What of the program the scene needs, and what is off, and why.
   subroutine add_choices(stepper, rows)
      type(stepper_t), intent(in) :: stepper
      type(report_rows_t), intent(inout) :: rows
      logical :: is_dynamic
      integer :: k

      associate (scene => stepper%scene, system => stepper%march%system)
         is_dynamic = any(step_is_dynamic(scene%step))
         call choose("contact", size(system%contact) > 0, "no *CONTACT PAIR, no *CONTACT")
         call choose("guards", any([(has_guards(system%contact(k)%contact), k = 1, &
            size(system%contact))]), trim(no_guards(scene)))
         call add_first_contact(stepper, rows)
         call choose("ties and equations", system%space%linear%n > 0, &
            "no *TIE, no *EQUATION, no *RIGID BODY")
         call choose("inertia", is_dynamic, "all steps are static")
         call choose("large displacements", any(scene%step%nlgeom), "no step has NLGEOM")
         call choose("pressure and other loads", has_loads(scene), "no *CLOAD, *DLOAD, *DSLOAD")
         call choose("stabilization of loose bodies", any(scene%step%stabilizes), &
            "no *CONTACT CONTROLS, STABILIZE")
      end associate

   contains

      subroutine choose(name, is_on, why_not)
         character(len=*), intent(in) :: name, why_not
         logical, intent(in) :: is_on
         type(report_row_t) :: row

         call row_begin(row, "parts", name // ":")
         call row_put(row, "part", name, "")
         if (is_on) then
            call row_put(row, "is", "on", " #")
         else
            call row_put(row, "is", "off", " #")
            call row_put(row, "because", why_not, ": #")
         end if
         call rows_add(rows, row)
      end subroutine choose

   end subroutine add_choices

   !> Why no pair has guards.
   pure function no_guards(scene) result(text)
      type(scene_t), intent(in) :: scene
      character(len=40) :: text
      logical :: has_one_side(size(scene%pair))
      integer :: k

      associate (pair => scene%pair)
         has_one_side = .not. (pair%both_sides .or. pair%slave == pair%master)
         if (size(pair) == 0) then
            text = "no contact"
         else if (.not. any(has_one_side)) then
            text = "contact holds the nodes of both sides"
         else if (any([(allocated(scene%surface(pair(k)%master)%wall), k = 1, size(pair))])) then
            text = "walls have no nodes"
         else if (any(pair%interaction%pressure%kind /= pressure_hard)) then
            text = "contact has a pressure by overclosure"
         else
            text = "GUARD=NO, or no node needs one"
         end if
      end associate
   end function no_guards

   !> Does a contact have constraints that wait for others?
   pure logical function has_guards(contact)
      class(contact_t), intent(in) :: contact
      integer :: i

      has_guards = any([(contact%waits(i), i = 1, contact%n_constraint)])
   end function has_guards

   !> How contact begins in dynamic steps, and who says so.
   subroutine add_first_contact(stepper, rows)
      type(stepper_t), intent(in) :: stepper
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      character(len=:), allocatable :: because, word
      integer :: k

      associate (scene => stepper%scene)
         k = findloc(step_is_dynamic(scene%step), .true., 1)
         if (k == 0 .or. size(stepper%march%system%contact) == 0) return
         because = "as the deck says"
         if (allocated(scene%deck%keeps_mass)) then
            because = "AUTO, no body has more than " // to_text(100.0_wp*most_moved, 2) // &
               " % of its mass at nodes of contact"
            if (len(scene%deck%keeps_mass) > 0) because = "AUTO keeps masses, " // &
               scene%deck%keeps_mass
         end if
         call row_begin(row, "parts", "first contact:")
         call row_put(row, "part", "first contact", "")
         call option_text("initiation", scene%step(k)%contact%initiation, word)
         call row_put(row, "is", word, " #")
         call row_put(row, "because", because, ": #")
         call rows_add(rows, row)
      end associate
   end subroutine add_first_contact

   pure logical function has_loads(scene)
      type(scene_t), intent(in) :: scene
      integer :: k

      has_loads = .false.
      do k = 1, size(scene%step)
         has_loads = has_loads .or. size(scene%step(k)%load) > 0
      end do
   end function has_loads

   !> Unknowns before and after elimination, and entries of the matrix.
   subroutine add_sizes(stepper, rows)
      type(stepper_t), intent(in) :: stepper
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row

      associate (space => stepper%march%system%space, matrix => stepper%march%system%matrix)
         call row_begin(row, "sizes", "step 1:")
         call row_put(row, "freedoms", count(space%is_alive), " # degrees of freedom")
         call row_put(row, "dependent", space%numbering%n_dependent, ", # eliminated")
         call row_put(row, "unknowns", space%numbering%n_unknown, ", # unknowns")
         if (allocated(matrix%row_start)) call row_put(row, "matrix_entries", &
            matrix%row_start(matrix%n_row + 1), ", # entries of the matrix")
         call rows_add(rows, row)
      end associate
   end subroutine add_sizes

   !> The increment that follows waves through the shortest element, against that of the deck.
   subroutine add_increment(stepper, body, rows)
      type(stepper_t), intent(in) :: stepper
      type(body_t), intent(in) :: body(:)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      real(wp) :: transit
      integer :: k

      k = findloc(step_is_dynamic(stepper%scene%step), .true., 1)
      if (k == 0) return
      transit = shortest_transit(body)
      if (.not. transit < huge(transit)) return
      call row_begin(row, "increments", "step")
      call row_put(row, "step", k, " #")
      associate (step => stepper%scene%step(k), march => stepper%march)
         call row_put(row, "h", step%time%h, ": h = #")
         if (march%explicit%is_on .and. march%state%clock%i_step == k) call row_put(row, &
            "critical_h", march%state%explicit%critical_h, ", critical h = #")
         call row_put(row, "courant_number", step%time%h/transit, &
            ", # wave transit times of the smallest element")
         call row_put(row, "recommended_h", transit, "; to resolve waves: h = #")
         if (step%time%h > many_transits*transit) call row_put(row, "remark", &
            "waves are not resolved, rigid motion and bending are", "; #")
      end associate
      call rows_add(rows, row)
   end subroutine add_increment

   pure real(wp) function shortest_transit(body)
      type(body_t), intent(in) :: body(:)

      shortest_transit = minval(body%transit, mask=body%n_rigid < body%n_element &
         .and. body%n_unknown > 0)
   end function shortest_transit

   !> Bodies so stiff that they may be rigid.
   subroutine advise_rigid(body, rows)
      type(body_t), intent(in) :: body(:)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      logical :: is_elastic(size(body))
      real(wp) :: softest, thickness
      integer :: i

      is_elastic = body%modulus > 0.0_wp .and. body%n_rigid == 0
      softest = minval(body%modulus, mask=is_elastic)
      do i = 1, size(body)
         if (.not. is_elastic(i) .or. body(i)%n_unknown == 0) cycle
         if (body(i)%modulus < much_stiffer*softest) cycle
         call row_begin(row, "advice", "body")
         call row_put(row, "body", i, " #")
         call row_put(row, "stiffer", body(i)%modulus/softest, &
            " is # times stiffer than the softest one: as a *RIGID BODY it saves ")
         call row_put(row, "fewer_percent", nint(100.0_wp*real(body(i)%n_unknown, wp) &
            /real(sum(body%n_unknown), wp)), "# % of the unknowns")
         ! Of the strain energy of a contact it stores no more than this.
         call row_put(row, "rebound_percent", 100.0_wp*softest/body(i)%modulus, &
            "; the rebound would change by less than # %")
         ! In bending it stores more, by the square of this and more.
         thickness = minval(body(i)%high - body(i)%low)/maxval(body(i)%high - body(i)%low)
         if (thickness < compact) call row_put(row, "thickness", thickness, &
            ", more if it bends: its thickness is # of its length")
         call rows_add(rows, row)
      end do
   end subroutine advise_rigid

   !> Bodies that hardly change their volume.
   subroutine advise_locking(solid, body, rows)
      type(solid_t), intent(in) :: solid
      type(body_t), intent(in) :: body(:)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      integer :: i

      do i = 1, size(body)
         if (.not. body(i)%ratio > 0.0_wp) cycle
         call row_begin(row, "advice", "body")
         call row_put(row, "body", i, " #")
         call row_put(row, "poisson", body(i)%ratio, " at nu = # locks: " &
            // trim(locking_advice(solid)))
         call rows_add(rows, row)
      end do
   end subroutine advise_locking

   !> Small increments make a comb of contact forces where slave nodes have mass.
   subroutine advise_massless(scene, body, rows)
      type(scene_t), intent(in) :: scene
      type(body_t), intent(in) :: body(:)
      type(report_rows_t), intent(inout) :: rows
      type(report_row_t) :: row
      character(len=:), allocatable :: cure
      real(wp) :: transit
      integer :: k

      if (size(scene%pair) == 0 &
         .or. any(scene%step%contact%initiation == initiation_massless)) return
      k = findloc(step_initiation(scene%step), initiation_persistent, 1)
      if (k == 0) return
      transit = shortest_transit(body)
      if (.not. (transit < huge(transit) .and. scene%step(k)%time%h < transit)) return
      call row_begin(row, "advice", "h is")
      cure = "; *CONTACT INITIATION, TYPE=MASSLESS makes them smooth on bodies at least two " // &
         "elements thick"
      ! What a fifth of the mass stands for, of a body whose whole outline has contacts.
      if (allocated(scene%deck%keeps_mass)) cure = "; they are smooth if bodies are at " // &
         "least " // trim(merge("ten     ", "fourteen", scene%n_dim == n_plane)) // &
         " elements thick: their surfaces are then without mass"
      call row_put(row, "courant_number", scene%step(k)%time%h/transit, &
         " # of the wave transit time " &
         // "of the smallest element: contact forces of nodes with mass jump up and down" // cure)
      call rows_add(rows, row)
   end subroutine advise_massless

end module emcon_scene_report
