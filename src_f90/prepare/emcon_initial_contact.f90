!> Contact before the first step: adjustment, orientation, crossing, penetration.
!>
!> All formulations are judged by the gaps of nodes over facets.
module emcon_initial_contact
   use emcon_contact, only : contact_t, gap_state_t
   use emcon_contact_registry, only : new_contact, new_start_gaps
   use emcon_errors, only : err_input, error_t, raise
   use emcon_facets, only : facets_length, facets_text
   use emcon_guards, only : guard_slack
   use emcon_host, only : host_find_contact, host_t
   use emcon_interactions, only : adjustment_moves, contact_options_t, contact_pair_t, &
      formulation_user, formulation_nts, pair_acts, pair_has_order, pair_holds_nodes, &
      pair_may_exchange
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_start_gaps, only : is_master, is_slave, start_gaps_t
   use emcon_steps, only : initiation_persistent, step_is_dynamic
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   use emcon_waiting_sides, only : find_waiting
   implicit none
   private
   public :: initial_contact_adjust, initial_contact_prepare

   !> Nodes looked at to see on which side of the other surface they are.
   integer, parameter :: most_samples = 64
   !> Iterations that put a node onto the surface.
   integer, parameter :: most_moves = 10
   integer, parameter :: n_space = 3
   !> Nodes named in a message.
   integer, parameter :: most_named = 10
   !> Coordinates in a deck are rounded: so many epsilons of them are no penetration.
   real(wp), parameter :: rounding = 8.0_wp*epsilon(1.0_wp)
   !> So far behind an edge, per its length, a surface that faces it overlaps it; farther behind it
   !> is on the wrong side.
   real(wp), parameter :: deepest_overlap = 0.5_wp
   !> Where a connected surface goes so far behind itself, per edge, it crosses itself.
   real(wp), parameter :: crossing_depth = 1.0e-2_wp
   !> Two polygons of one curve dip into each other by less than this, per edge, at blunt corners.
   real(wp), parameter :: deepest_dip = 0.2_wp

contains

   !> Move the nodes that ADJUST= names onto their surface and check every pair; the notes tell
   !> what was done.
   subroutine initial_contact_prepare(scene, notes, error, host)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host     !! contact of pairs, among others
      type(contact_options_t) :: options
      class(start_gaps_t), allocatable :: contact
      logical :: is_checked(size(scene%surface))
      logical :: is_meant                        !! overclosure is
      real(wp) :: noise
      integer :: i

      is_meant = .false.
      noise = coordinate_noise(scene)
      if (size(scene%step) > 0) then
         options = scene%step(1)%contact%options
         is_meant = scene%step(1)%contact%resolves_overclosure
      end if
      is_checked = .false.
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (pair%formulation == formulation_user) then
               if (pair_acts(pair, 1) .and. .not. is_meant) call check_given(scene, i, options, &
                  noise, error, host)
               if (allocated(error)) return
               cycle
            end if
            call let_wait(scene, pair, notes)
            call new_start_gaps(scene, pair, contact, error, options)
            if (allocated(error)) return
            if (pair_acts(pair, 1) .and. .not. contact%is_self) call check_two(scene, pair, &
               contact, noise, is_checked, error)
            if (allocated(error)) return
            if (adjustment_moves(pair%adjust)) then
               call adjust_pair(scene, pair, contact, notes)
               noise = coordinate_noise(scene)
            end if
            if (.not. pair_acts(pair, 1)) cycle   ! what is closed when it begins is looked at then
            ! Bodies of one surface may cross each other where their overlap is to be resolved.
            if (contact%is_self .and. .not. (is_meant .and. pair_holds_nodes(pair))) then
               call check_crossing(scene, pair%slave, contact, is_slave, is_checked, error)
            end if
            if (is_meant .and. .not. allocated(error)) cycle
            if (allocated(error)) return
            call check_penetration(scene, pair, contact, noise, error)
            if (allocated(error) .and. may_exchange(scene, pair)) call exchange(scene, pair, &
               options, noise, notes, error)
            if (allocated(error) .and. pair%is_reverse .and. pair%may_choose) then
               deallocate(error)                     ! `check_corners` has let the nodes pass
               call become_guard(scene, pair, notes, "dips into edges of " // &
                  scene%surface(pair%master)%name // " at the start")
               cycle
            end if
            if (.not. allocated(error)) call check_corners(scene, pair, options, noise, error)
            if (allocated(error)) return
         end associate
      end do
   end subroutine initial_contact_prepare

   !> Of a host's pairs nothing is checked: slave nodes move onto masters where that is wanted.
   subroutine initial_contact_adjust(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      class(start_gaps_t), allocatable :: contact
      integer :: i

      do i = 1, size(scene%pair)
         if (.not. scene%pair(i)%adjust%distance >= 0.0_wp) cycle
         call new_start_gaps(scene, scene%pair(i), contact, error, scene%pair(i)%options)
         if (allocated(error)) return
         call adjust_pair(scene, scene%pair(i), contact, notes)
      end do
   end subroutine initial_contact_adjust

   !> Neither of two surfaces crosses itself, and both face each other.
   subroutine check_two(scene, pair, contact, noise, is_checked, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(start_gaps_t), intent(inout) :: contact
      real(wp), intent(in) :: noise              !! of coordinates [L]
      logical, intent(inout) :: is_checked(:)    !! (n_surface) for crossings
      type(error_t), allocatable, intent(out) :: error

      call check_crossing(scene, pair%slave, contact, is_slave, is_checked, error)
      if (.not. allocated(error)) call check_crossing(scene, pair%master, contact, is_master, &
         is_checked, error)
      if (.not. allocated(error)) call check_sides(scene, pair, contact, noise, "master", error)
      if (.not. allocated(error)) call check_slave_side(scene, pair, contact, noise, error)
   end subroutine check_two

   !> Where the nodes of a half of a pair have to wait for those without mass of the other half they
   !> are guards, and keep their mass.
   subroutine let_wait(scene, pair, notes)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair
      type(notes_t), intent(inout) :: notes
      character(len=:), allocatable :: why

      call find_waiting(scene, pair, pair%is_reverse, why)
      if (len(why) == 0) return
      call become_guard(scene, pair, notes, why)
      pair%initiation = initiation_persistent
   end subroutine let_wait

   !> Nodes that cannot be held at their master, as where polygons of one curve dip into each other,
   !> are kept from going in farther than guards allow.
   subroutine become_guard(scene, pair, notes, why)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair
      type(notes_t), intent(inout) :: notes
      character(len=*), intent(in) :: why        !! to follow on the name of its slave

      pair%slack = guard_slack
      call note_add(notes, where_text(scene, pair%origin) // ": surface " // &
         scene%surface(pair%slave)%name // " " // why // ": its nodes are guarded, not held")
   end subroutine become_guard

   !> Does the deck leave it open which side of a pair is the slave?
   pure logical function may_exchange(scene, pair)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair

      may_exchange = pair_may_exchange(pair) .and. .not. any(scene%pair%slave == pair%master &
         .and. scene%pair%master == pair%slave)
   end function may_exchange

   !> The finer of two polygons of curves that fit each other may begin with nodes behind edges of
   !> the other one, and that with none behind its own: then that is the slave.
   subroutine exchange(scene, pair, options, noise, notes, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(inout) :: pair
      type(contact_options_t), intent(in) :: options
      real(wp), intent(in) :: noise              !! of coordinates [L]
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(inout) :: error     !! out: none, or the same
      type(contact_pair_t) :: other
      class(start_gaps_t), allocatable :: contact
      type(error_t), allocatable :: fault

      other = reversed(pair)
      other%is_exchanged = .not. pair%is_exchanged
      call new_start_gaps(scene, other, contact, fault, options)
      if (.not. allocated(fault)) call check_penetration(scene, other, contact, noise, fault)
      if (allocated(fault)) return
      deallocate(error)
      pair = other
      call note_add(notes, where_text(scene, pair%origin) // ": surface " // &
         scene%surface(pair%slave)%name // " is the slave: nodes of " // &
         scene%surface(pair%master)%name // " begin behind its edges")
   end subroutine exchange

   !> A surface that crosses itself has no outside. Each surface is looked at once.
   subroutine check_crossing(scene, number, contact, which, is_checked, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: number              !! of the surface
      class(start_gaps_t), intent(in) :: contact
      integer, intent(in) :: which               !! of its surfaces: `is_slave` or `is_master`
      logical, intent(inout) :: is_checked(:)    !! (n_surface)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: one, other
      integer :: first, second

      if (is_checked(number) .or. contact%surface(which)%n_facet == 0) return
      is_checked(number) = .true.
      call contact%crossing(which, scene, first, second)
      if (first == 0) return
      call facets_text(contact%surface(which), scene, first, one)
      call facets_text(contact%surface(which), scene, second, other)
      associate (surface => scene%surface(number))
         call raise(error, err_input, where_text(scene, surface%origin) // ": error: contact " // &
            "surface " // surface%name // " crosses itself: " // one // " and " // other)
      end associate
   end subroutine check_crossing

   !> The same pair with slave and master exchanged.
   pure function reversed(pair) result(other)
      type(contact_pair_t), intent(in) :: pair
      type(contact_pair_t) :: other

      other = pair
      other%slave = pair%master
      other%master = pair%slave
   end function reversed

   !> Master nodes are all behind the slave surface.
   subroutine check_slave_side(scene, pair, measured, noise, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(start_gaps_t), intent(in) :: measured      !! of the slave nodes
      real(wp), intent(in) :: noise              !! of coordinates [L]
      type(error_t), allocatable, intent(out) :: error
      class(start_gaps_t), allocatable :: contact

      if (measured%surface(is_slave)%n_facet == 0 &
         .or. measured%surface(is_master)%n_facet == 0) then
         return
      end if
      call new_start_gaps(scene, reversed(pair), contact, error)
      if (allocated(error)) return
      call check_sides(scene, reversed(pair), contact, noise, "slave", error)
   end subroutine check_slave_side

   !> Slave nodes are all behind the master surface: its normals point away from them. Or they are
   !> within its pad only, deeper than any overlap that a step may begin with.
   subroutine check_sides(scene, pair, contact, noise, title, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(start_gaps_t), intent(inout) :: contact
      real(wp), intent(in) :: noise              !! of coordinates [L]
      character(len=*), intent(in) :: title      !! what the deck calls the master of `pair`
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: remedy
      integer :: i, stride, n_over, n_behind, n_within
      real(wp) :: gap
      logical :: is_over

      if (contact%is_closed) return
      stride = max(1, contact%n/most_samples)
      n_over = 0
      n_behind = 0
      n_within = 0
      do i = 1, contact%n, stride
         call contact%nearest(i, scene, gap, is_over)
         if (.not. is_over) cycle
         n_over = n_over + 1
         if (.not. is_behind(scene, contact, i, gap, noise)) cycle
         n_behind = n_behind + 1
         if (.not. is_behind(scene, contact, i, gap + pair%interaction%offset, noise)) n_within = &
            n_within + 1
      end do
      if (n_behind == n_over .and. n_within > 0) then
         call raise(error, err_input, where_text(scene, pair%origin) // ": error: PAD THICKNESS=" &
            // to_text(pair%interaction%offset, 9) // " is more than the distance of surfaces " &
            // scene%surface(pair%slave)%name // " and " // scene%surface(pair%master)%name // &
            ", and the first step cannot push them apart; take a thinner pad, or move them apart")
      else if (n_over > 0 .and. n_behind == n_over) then
         call find_remedy(scene, pair%master, remedy)
         call raise(error, err_input, where_text(scene, pair%origin) // ": error: the normals of " &
            // title // " surface " // scene%surface(pair%master)%name // " point away from " // &
            "surface " // scene%surface(pair%slave)%name // remedy)
      end if
   end subroutine check_sides

   !> What to do where a master points away.
   pure subroutine find_remedy(scene, master, remedy)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: master              !! 1..n_surface
      character(len=:), allocatable, intent(out) :: remedy

      if (allocated(scene%surface(master)%wall)) then
         remedy = "; turn the normal of its shape, or put the bodies on its other side"
      else if (scene%n_dim == n_space) then
         remedy = "; check the face labels"
      else
         remedy = "; check the face labels; bodies lie to the left of edges (TYPE=EDGE) and to " &
            // "the right of profiles (TYPE=SEGMENTS)"
      end if
   end subroutine find_remedy

   !> Is slave node `i` on the wrong side of the master, rather than slightly inside the body?
   pure logical function is_behind(scene, contact, i, gap, noise)
      type(scene_t), intent(in) :: scene
      class(start_gaps_t), intent(in) :: contact
      integer, intent(in) :: i
      real(wp), intent(in) :: gap                !! over contact%facet(i) [L]
      real(wp), intent(in) :: noise              !! of coordinates [L]

      is_behind = gap < -deepest_overlap*contact%other_size(i)
      if (is_behind .or. gap >= -noise .or. contact%surface(is_slave)%n_facet == 0) return
      is_behind = .not. contact%faces(i, scene)
   end function is_behind

   !> What the coordinates are uncertain by.
   pure real(wp) function coordinate_noise(scene)
      type(scene_t), intent(in) :: scene

      coordinate_noise = rounding*maxval(abs(scene%x))
   end function coordinate_noise

   !> Put the slave nodes within ADJUST= of the surface, and those behind it, onto it, or those that
   !> face it to their *CLEARANCE, free of stress: along the normal, in the reference configuration.
   !> Of two nodes at one place of a
   !> surface of tied pieces the other one goes along.
   subroutine adjust_pair(scene, pair, contact, notes)
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(start_gaps_t), intent(inout) :: contact
      type(notes_t), intent(inout) :: notes
      type(gap_state_t) :: state
      real(wp) :: offset(size(scene%x, 1)), largest
      character(len=:), allocatable :: text
      logical :: is_meant, is_last
      integer :: i, k, n_moved

      call contact%measure(scene)
      largest = 0.0_wp
      n_moved = 0
      do i = 1, contact%n
         if (contact%facet(i) == 0) cycle
         state = contact%state(i)
         is_meant = state%gap0 <= pair%adjust%distance
         if (pair%adjust%is_clearance) is_meant = contact%faces(i, scene)
         if (pair%adjust%set > 0) is_meant = &
            find_sorted(scene%set%node(pair%adjust%set)%item, contact%node(i)) > 0
         if (.not. (state%is_over .and. is_meant)) cycle
         largest = max(largest, abs(state%gap0 - pair%adjust%clearance))
         n_moved = n_moved + 1
         do k = 1, most_moves
            call contact%offset(i, scene, pair%adjust%clearance, offset, is_last)
            associate (node => contact%node(i), duplicate => contact%duplicate(i))
               scene%x(:, node) = scene%x(:, node) - offset
               if (duplicate > 0) scene%x(:, duplicate) = scene%x(:, duplicate) - offset
            end associate
            if (is_last) exit
         end do
      end do
      text = where_text(scene, pair%origin) // ": " // trim(merge("*CLEARANCE", "ADJUST    ", &
         pair%adjust%is_clearance))
      if (pair%origin%file == 0) text = "contact of surfaces " // &
         scene%surface(pair%slave)%name // " and " // scene%surface(pair%master)%name // ": adjust"
      call note_add(notes, text // " moves " // to_text(n_moved) // " slave nodes, by " // &
         to_text(largest) // " at most")
   end subroutine adjust_pair

   !> Slave nodes behind the master surface.
   subroutine check_penetration(scene, pair, contact, noise, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      class(start_gaps_t), intent(inout) :: contact
      real(wp), intent(in) :: noise              !! of coordinates [L]
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: limit(contact%n)
      integer :: i, n
      character(len=:), allocatable :: found, text

      call contact%measure(scene)
      limit = merge(noise + contact%doubt, huge(noise), contact%facet > 0)
      if (contact%is_self) then
         do i = 1, contact%n
            if (contact%facet(i) == 0) cycle
            if (.not. contact%is_connected(i)) cycle
            ! Without a crossing this is the other side of a thin strip.
            associate (state => contact%state(i))
               if (state%gap0 < -crossing_depth*state%size) limit(i) = huge(limit)
            end associate
         end do
      end if
      call find_behind(scene, contact%node, contact%state, limit, n, found)
      if (n == 0) return
      if (scene%n_dim == n_space) call add_deepest(scene, contact, limit, found)
      call tell_deep(scene, pair, n, text)
      call raise(error, err_input, where_text(scene, pair%origin) // ": error: " // text // &
         found // "; move them, or let *CONTACT PAIR, ADJUST= do it; where the overlap is " // &
         "meant, as of a press fit, begin with a *STATIC step with *CONTACT INTERFERENCE, SHRINK")
   end subroutine check_penetration

   !> That `n` nodes of the slave penetrate the master.
   pure subroutine tell_deep(scene, pair, n, text)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      integer, intent(in) :: n                   !! > 0
      character(len=:), allocatable, intent(out) :: text

      text = " slave node of surface " // scene%surface(pair%slave)%name // " penetrates"
      if (n > 1) text = " slave nodes of surface " // scene%surface(pair%slave)%name // " penetrate"
      text = to_text(n) // text // " surface " // scene%surface(pair%master)%name
   end subroutine tell_deep

   !> Add the face that the deepest node is behind.
   subroutine add_deepest(scene, contact, limit, text)
      type(scene_t), intent(in) :: scene
      class(start_gaps_t), intent(in) :: contact
      real(wp), intent(in) :: limit(:)           !! as `find_behind` has it
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: face

      associate (deepest => minloc(contact%state%gap0, dim=1, mask=contact%state%is_over .and. &
            contact%state%gap0 < -limit))
         call contact%other_text(deepest, scene, face)
         text = text // "; the deepest, " // to_text(scene%node%label(contact%node(deepest))) // &
            ", is behind " // face
      end associate
   end subroutine add_deepest

   !> Slave nodes behind the master surface, as the contact that a program gives for pair `i` sees
   !> them.
   subroutine check_given(scene, i, options, noise, error, host)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i
      type(contact_options_t), intent(in) :: options
      real(wp), intent(in) :: noise              !! of coordinates [L]
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host
      class(contact_t), allocatable :: contact
      real(wp) :: still(size(scene%x, 1), size(scene%x, 2))
      integer :: k, n
      character(len=:), allocatable :: found, text

      k = 0
      if (present(host)) k = host_find_contact(host, i)
      if (k == 0) return                         ! `system_init` tells that it is missing
      call new_contact(scene, scene%pair(i), contact, error, host%contact(k)%contact)
      if (allocated(error)) return
      call contact%suit_steps(any(.not. step_is_dynamic(scene%step)))
      call contact%configure(scene%x, options)
      still = 0.0_wp
      call contact%begin_step(scene%x, scene%u0, still)
      call contact%measure(scene%x, scene%u0, still)
      call find_behind(scene, contact%node, contact%state, merge(noise, huge(noise), &
         contact%state%is_near), n, found)
      if (n == 0) return
      call tell_deep(scene, scene%pair(i), n, text)
      call raise(error, err_input, where_text(scene, scene%pair(i)%origin) // ": error: " // text &
         // found // "; move them")
   end subroutine check_given

   !> Master nodes behind the slave surface, as a corner between two slave nodes: an integrated gap
   !> sees it, but ADJUST= cannot mend it.
   subroutine check_corners(scene, pair, options, noise, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(contact_options_t), intent(in) :: options
      real(wp), intent(in) :: noise              !! of coordinates [L]
      type(error_t), allocatable, intent(out) :: error
      class(start_gaps_t), allocatable :: contact
      logical, allocatable :: sharp(:)
      real(wp), allocatable :: limit(:)
      character(len=:), allocatable :: found
      integer :: k, n

      if (pair%slave == pair%master .or. pair%is_reverse) return
      if (allocated(scene%surface(pair%master)%wall)) return     ! without corners
      if (pair%formulation == formulation_nts) then
         if (pair_has_order(pair) .or. .not. pair%may_choose) return
      end if
      call new_start_gaps(scene, reversed(pair), contact, error)
      if (allocated(error)) return
      call contact%measure(scene)
      allocate(sharp(contact%n))
      limit = merge(noise, huge(noise), contact%facet > 0)
      call contact%is_sharp(scene, options%smoothing_angle, sharp)
      do k = 1, contact%n
         if (contact%facet(k) == 0) cycle
         if (.not. sharp(k)) limit(k) = limit(k) + deepest_dip*contact%state(k)%size
         if (.not. contact%faces(k, scene)) limit(k) = huge(limit)
      end do
      call find_behind(scene, contact%node, contact%state, limit, n, found)
      if (n == 0) return
      call raise(error, err_input, where_text(scene, pair%origin) // ": error: " // to_text(n) // &
         " master nodes of surface " // scene%surface(pair%master)%name // " penetrate surface " &
         // scene%surface(pair%slave)%name // ", between its nodes" // found // &
         "; move them, or refine the slave surface and let *CONTACT PAIR, ADJUST= move its nodes")
   end subroutine check_corners

   !> How many of the nodes measured are behind the surface by more than `limit`, and a text with
   !> their labels and depths.
   subroutine find_behind(scene, node, state, limit, n, text)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: node(:)
      type(gap_state_t), intent(in) :: state(:)  !! of each
      real(wp), intent(in) :: limit(:)           !! of each; huge: no surface is near [L]
      integer, intent(out) :: n
      character(len=:), allocatable, intent(out) :: text
      type(string_t) :: found(size(node))
      real(wp) :: deepest
      integer :: i

      n = 0
      deepest = 0.0_wp
      do i = 1, size(node)
         if (.not. state(i)%is_over .or. state(i)%gap0 >= -limit(i)) cycle
         n = n + 1
         deepest = max(deepest, -state(i)%gap0)
         found(n)%text = to_text(scene%node%label(node(i))) // " (" // &
            to_text(-state(i)%gap0) // ")"
      end do
      text = ", by " // to_text(deepest) // " at most; node (depth): " // &
         joined(found(:n), ", ", most_named)
   end subroutine find_behind

end module emcon_initial_contact
