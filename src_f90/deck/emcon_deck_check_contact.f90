!> The contact pairs, as far as they can be judged before anything moves.
!>
!> Which surface is the slave: docs/theory.md, section 4.12; in space no more than advice.
module emcon_deck_check_contact
   use emcon_deck_check_sides, only : advise_wall, find_advice
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_dimension, only : n_space
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, add_warning, label_list
   use emcon_interactions, only : contact_pair_t, formulation_user, formulation_mortar, &
      formulation_segment, multiplier_standard, pair_has_order, pair_may_exchange
   use emcon_kinds, only : wp
   use emcon_massless_surfaces, only : pair_sheds_mass, surface_keeps_mass
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : step_t
   use emcon_surface_facets, only : surface_facets
   implicit none
   private
   public :: choose_slaves, check_pairs

contains

   !> Exchange slave and master where the program may choose and the slave would push its master
   !> sideways, or could not lose the mass that it is to lose, unless more slave nodes than before
   !> could not follow. It is told if not asked for.
   subroutine choose_slaves(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t) :: other
      character(len=:), allocatable :: advice
      logical :: has_reverse(size(scene%pair)), is_bent
      integer :: i

      if (reader%doubt%shapes .or. reader%log%n_errors > 0) return
      call find_reverses(scene%pair, has_reverse)
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (pair%slave == 0 .or. pair%master == 0 .or. has_reverse(i)) cycle
            if (.not. pair_may_exchange(pair)) cycle
            call find_advice(scene, pair, advice, is_bent)
            if (pair_sheds_mass(scene, pair)) call look_for_mass(scene, pair, advice, is_bent)
            if (.not. is_bent) cycle
            other = exchanged(pair)
            if (n_stuck(scene, other) > n_stuck(scene, pair)) cycle
            if (.not. pair%is_asked) call add_warning(reader%log, pair%origin, "*CONTACT PAIR: " &
               // "slave surface " // scene%surface(pair%slave)%name // advice &
               // ", and is; SIDES=ONE keeps the order")
            pair = other
         end associate
      end do
   end subroutine choose_slaves

   !> The slave is that surface which can lose its mass, if only one of them can.
   subroutine look_for_mass(scene, pair, advice, is_better)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(inout) :: advice     !! to follow on the slave's name
      logical, intent(inout) :: is_better        !! the master should be the slave
      logical :: keeps_mass(2)

      keeps_mass = [surface_keeps_mass(scene, pair%slave), &
         surface_keeps_mass(scene, pair%master)]
      if (all(keeps_mass) .or. .not. any(keeps_mass)) return
      is_better = keeps_mass(1)
      advice = " is rigid or prescribed and keeps its mass; master surface " &
         // scene%surface(pair%master)%name // " should be the slave"
   end subroutine look_for_mass

   !> `pair` with its master as the slave.
   pure type(contact_pair_t) function exchanged(pair)
      type(contact_pair_t), intent(in) :: pair

      exchanged = pair
      exchanged%slave = pair%master
      exchanged%master = pair%slave
      exchanged%is_exchanged = .true.
   end function exchanged

   !> So many slave nodes cannot follow their master freely in some step.
   pure integer function n_stuck(scene, pair)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      logical :: is_slave(size(scene%node%label)), is_stuck(size(scene%node%label))
      integer :: i

      is_slave = .false.
      is_stuck = .false.
      call mark_nodes(scene, [pair%slave], is_slave)
      do i = 1, size(scene%step)
         is_stuck = is_stuck .or. constraint_freedom(scene, scene%step(i), pair) < scene%n_dim
      end do
      n_stuck = count(is_slave .and. is_stuck)
   end function n_stuck

   !> The surfaces of contact pairs: without common nodes, free to move, the slave the smaller one.
   subroutine check_pairs(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical :: has_reverse(size(scene%pair)), has_common
      integer :: i

      if (reader%doubt%shapes) return
      call find_reverses(scene%pair, has_reverse)
      do i = 1, size(scene%pair)
         if (scene%pair(i)%slave == 0 .or. scene%pair(i)%master == 0) cycle
         if (scene%pair(i)%is_reverse) cycle
         call check_common_nodes(reader, scene, scene%pair(i), has_common)
         call check_freedom(reader, scene, scene%pair(i))
         call check_wall(reader, scene, scene%pair(i))
         if (has_common .or. has_reverse(i)) cycle
         if (reader%log%n_errors == 0) call check_sides(reader, scene, scene%pair(i))
      end do
   end subroutine check_pairs

   !> Warn of faces that are larger than the wall they meet.
   subroutine check_wall(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable :: advice

      call advise_wall(scene, pair, advice)
      if (len(advice) > 0) call add_warning(reader%log, pair%origin, "*CONTACT PAIR: slave " &
         // "surface " // scene%surface(pair%slave)%name // advice)
   end subroutine check_wall

   !> Warn of a slave surface that should be the master, or a finer one.
   subroutine check_sides(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable :: advice
      logical :: is_bent

      if (pair%is_exchanged .or. .not. pair_has_order(pair)) return
      if (pair%formulation == formulation_user) return
      call find_advice(scene, pair, advice, is_bent)
      if (advice == "") return
      if (n_stuck(scene, exchanged(pair)) > n_stuck(scene, pair)) then
         advice = advice // ", but has nodes that cannot follow: refine " &
            // scene%surface(pair%slave)%name
      else
         advice = advice // ": swap the two"
      end if
      call add_warning(reader%log, pair%origin, "*CONTACT PAIR: slave surface " &
         // scene%surface(pair%slave)%name // advice)
   end subroutine check_sides

   !> Two surfaces of a pair must not share nodes; a surface in contact with itself is one surface.
   subroutine check_common_nodes(reader, scene, pair, has_common)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      logical, intent(out) :: has_common
      logical, allocatable :: is_slave(:), is_master(:)
      character(len=:), allocatable :: whole

      has_common = .false.
      if (pair%slave == pair%master) return
      allocate(is_slave(size(scene%node%label)), is_master(size(scene%node%label)), &
         source=.false.)
      associate (slave => scene%surface(pair%slave), master => scene%surface(pair%master))
         call mark_nodes(scene, [pair%slave], is_slave)
         call mark_nodes(scene, [pair%master], is_master)
         has_common = any(is_slave .and. is_master)
         if (.not. has_common) return
         whole = ""
         if (all(is_master .or. .not. is_slave)) then
            whole = master%name
         else if (all(is_slave .or. .not. is_master) .and. .not. slave%is_nodal) then
            whole = slave%name
         end if
         if (whole /= "") whole = "; for contact of a surface with itself name it twice: " &
            // whole // ", " // whole
         call add_error(reader%log, pair%origin, "*CONTACT PAIR: slave surface " // slave%name &
            // " and master surface " // master%name // " share node " &
            // label_list(pack(scene%node%label, is_slave .and. is_master)) // whole)
      end associate
   end subroutine check_common_nodes

   !> A slave node that is prescribed in part is told. One that is wholly prescribed is where the
   !> deck puts it: its master gives way, or where nothing can a step in which it is to act fails.
   !> With both sides the nodes of the master are slaves too.
   subroutine check_freedom(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      logical, allocatable :: is_slave(:), is_held(:), is_guided(:)
      integer, allocatable :: n_free(:)
      character(len=:), allocatable :: others
      integer :: i

      if (any(pair%formulation == [0, formulation_user]) .or. pair%both_sides) return
      allocate(is_slave(size(scene%node%label)), is_held(size(scene%node%label)), &
         is_guided(size(scene%node%label)), source=.false.)
      call mark_nodes(scene, [pair%slave], is_slave)
      do i = 1, size(scene%step)
         n_free = constraint_freedom(scene, scene%step(i), pair)
         is_held = is_held .or. (is_slave .and. n_free == 0)
         is_guided = is_guided .or. (is_slave .and. n_free < scene%n_dim)
      end do
      is_guided = is_guided .and. .not. is_held
      others = "the other one"
      if (scene%n_dim == n_space) others = "the others"
      if (any(is_guided)) call add_warning(reader%log, pair%origin, "*CONTACT PAIR: slave node " &
         // label_list(pack(scene%node%label, is_guided)) // " of surface " &
         // scene%surface(pair%slave)%name // " is prescribed in one direction: contact can " &
         // "move it in " // others // " only, and cannot where the master faces along the " // &
         "prescribed one")
   end subroutine check_freedom

   !> For each slave node: so many degrees of freedom of one node can fulfil its constraint.
   !>
   !> Node to surface it is the slave node that must follow. An integrated constraint can be
   !> fulfilled by the master as well, and under standard multipliers by the neighbours of the
   !> slave node; dual ones leave these out where the edges are covered.
   pure function constraint_freedom(scene, step, pair) result(n_free)
      type(scene_t), intent(in) :: scene
      type(step_t), intent(in) :: step
      type(contact_pair_t), intent(in) :: pair
      integer :: n_free(size(scene%node%label))
      integer :: own(size(scene%node%label))
      logical :: is_master(size(scene%node%label))
      integer, allocatable :: edge(:, :)
      integer :: k

      own = scene%n_dim
      do k = 1, size(step%prescribed)
         own(step%prescribed(k)%node) = own(step%prescribed(k)%node) - 1
      end do
      do k = 1, size(step%turn)
         if (step%turn(k)%is_about) own(scene%rigid(step%turn(k)%rigid)%node) = 0
      end do
      n_free = own
      if (all(pair%formulation /= [formulation_segment, formulation_mortar])) return
      is_master = .false.
      call mark_nodes(scene, [pair%master], is_master)
      if (any(is_master .and. own > 0)) then
         n_free = scene%n_dim
      else if (step%contact%options%multiplier == multiplier_standard) then
         call surface_facets(scene, scene%surface(pair%slave), edge)
         do k = 1, size(edge, 2)
            associate (node => edge(:, k))
               if (all(node > 0)) n_free(node) = max(n_free(node), own(node(2:1:-1)))
            end associate
         end do
      end if
   end function constraint_freedom

   !> Whether each pair is also listed with slave and master in turn.
   pure subroutine find_reverses(pair, has_reverse)
      type(contact_pair_t), intent(in) :: pair(:)
      logical, intent(out) :: has_reverse(:)       !! (n_pair)
      type(name_index_t) :: given
      integer :: i

      do i = 1, size(pair)
         call name_index_put(given, name_index_pair(pair(i)%slave, pair(i)%master), i)
      end do
      do i = 1, size(pair)
         has_reverse(i) = name_index_find(given, &
            name_index_pair(pair(i)%master, pair(i)%slave)) > 0
      end do
   end subroutine find_reverses

end module emcon_deck_check_contact
