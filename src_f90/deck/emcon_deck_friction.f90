!> *FRICTION of surface interactions, and what it does not go with.
module emcon_deck_friction
   use emcon_deck_dimension, only : n_plane, n_space
   use emcon_deck_fields, only : data_error, data_open, data_t, drop_zeros, get_real, next_line, &
      refuse_lines
   use emcon_deck_reader, only : card_error, card_t, has_option, reader_t
   use emcon_diagnostics, only : add_error, add_warning
   use emcon_interactions, only : contact_pair_t, pressure_hard, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_massless_surfaces, only : pair_keeps_mass
   use emcon_name_index, only : name_index_find, name_index_pair, name_index_put, name_index_t
   use emcon_rigid_bodies, only : rigid_far_node
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, initiation_velocity_update, method_null_space, &
      method_saddle_point, step_initiation, step_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: read_friction, check_friction

   !> The coefficient of what is rough.
   real(wp), parameter :: rough = sqrt(huge(1.0_wp))

contains

   !> The coefficient of Coulomb's law, and the slope of stick: shear by slip, 0 where stick is
   !> exact. Nothing but the coefficient bounds friction. What is rough does not slide: a
   !> coefficient that no force is above.
   subroutine read_friction(reader, card, coefficient, stick)
      type(reader_t), intent(inout) :: reader
      type(card_t), intent(in) :: card
      real(wp), intent(inout) :: coefficient
      real(wp), intent(inout) :: stick           !! [M/(L^2 T^2)]
      type(data_t) :: data
      integer :: n

      stick = 0.0_wp
      if (has_option(card, "ROUGH")) then
         coefficient = rough
         call refuse_lines(reader, card)
         return
      end if
      call data_open(data, card)
      n = 0
      do while (next_line(reader, data))
         n = n + 1
         call get_real(reader, data, 1, "friction coefficient", coefficient)
         call drop_zeros(data, 1)
         if (data%ok .and. data%n > 1) call get_real(reader, data, 1 + 1, "stick slope", stick)
         if (data%ok .and. stick < 0.0_wp) then
            call data_error(reader, data, "the stick slope " // to_text(stick) // " is negative")
            stick = 0.0_wp
         end if
         if (data%ok .and. coefficient < 0.0_wp) then
            call data_error(reader, data, "the friction coefficient " // to_text(coefficient) &
               // " is negative")
            coefficient = 0.0_wp
         end if
         if (n == 2) then
            call data_error(reader, data, "only one data line is read: the coefficient is the " &
               // "same for all rates, pressures and temperatures")
         else if (n == 1 .and. data%n > 1 + 1) then
            call data_error(reader, data, "only the coefficient and a stick slope are read: " &
               // "friction has no other limit and depends on no rate, pressure or " // &
               "temperature; leave out the other values")
         end if
      end do
      if (n == 0) call card_error(reader, card, "a data line with the coefficient is missing")
   end subroutine read_friction

   !> Friction is in steps whose scheme has its forces along discrete gradients or which are static,
   !> and which hold contact exactly.
   subroutine check_friction(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(name_index_t) :: given                !! pairs so far, by slave and master
      integer :: i, k

      associate (pair => scene%pair, step => scene%step)
         do i = 1, size(pair)
            if (pair(i)%slave == 0 .or. pair(i)%master == 0) cycle   ! unknown surfaces are told
            call check_other_way(reader, pair(:i), given)
            if (.not. pair(i)%interaction%friction > 0.0_wp .or. pair(i)%is_reverse) cycle
            do k = 1, size(step)
               call check_step(reader, pair(i), step(k), k)
            end do
            call check_pad(reader, scene, pair(i))
            call check_stick(reader, pair(i))
            if (any(step_initiation(step) == initiation_massless) &
               .and. pair_keeps_mass(pair(i))) then
               call add_warning(reader%log, pair(i)%origin, "*CONTACT PAIR: its surface " &
                  // "interaction has *FRICTION and RESTITUTION or *DAMPING: both surfaces keep " &
                  // "their mass, and hold gaps as PERSISTENT does")
            end if
         end do
      end associate
   end subroutine check_friction

   !> What holds gaps sticks exactly.
   subroutine check_stick(reader, pair)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair

      associate (surface => pair%interaction)
         if (surface%pressure%kind == pressure_hard .and. surface%stick > 0.0_wp) then
            call add_warning(reader%log, pair%origin, "*CONTACT PAIR: the stick slope of its " &
            // "*FRICTION has no effect: contact is hard, and a sticking contact does not slip")
         end if
      end associate
   end subroutine check_stick

   !> Nodes with a pad are discs or balls. Discs roll if a rigid body turns them, over edges.
   subroutine check_pad(reader, scene, pair)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      integer :: i
      logical :: rolls

      if (.not. pair%interaction%offset > 0.0_wp) return
      if (.not. scene%surface(pair%slave)%is_nodal) return
      rolls = scene%n_dim == n_plane .and. &
         .not. any(scene%step%contact%options%smoothing == smoothing_hermite)
      associate (node => scene%surface(pair%slave)%node)
         do i = 1, size(node)
            rolls = rolls .and. rigid_far_node(scene%rigid, node(i), scene%x) > 0
         end do
      end associate
      if (.not. rolls) call add_warning(reader%log, pair%origin, "*CONTACT PAIR: its surface " &
         // "interaction has *FRICTION and a PAD THICKNESS: friction acts at the nodes, so that " &
         // "discs slide, but do not roll; they do in the plane on nodes of a *RIGID BODY, " &
         // "without HERMITE")
   end subroutine check_pad

   !> Two surfaces that are named in both orders rub in the same way in both.
   subroutine check_other_way(reader, pair, given)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair(:)    !! the last one is looked at
      type(name_index_t), intent(inout) :: given     !! where in `pair` slave and master are
      integer :: j

      associate (new => pair(size(pair)))
         j = name_index_find(given, name_index_pair(new%master, new%slave))
         if (name_index_find(given, name_index_pair(new%slave, new%master)) == 0) then
            call name_index_put(given, name_index_pair(new%slave, new%master), size(pair))
         end if
         if (j == 0) return
         if (abs(pair(j)%interaction%friction - new%interaction%friction) <= 0.0_wp .and. &
            abs(pair(j)%interaction%rebound - new%interaction%rebound) <= 0.0_wp) return
         call add_error(reader%log, new%origin, "*CONTACT PAIR: the surfaces are a pair in the " &
            // "other order too, with another *FRICTION: give both the same interaction")
      end associate
   end subroutine check_other_way

   !> What a step of the deck does not go with.
   subroutine check_step(reader, pair, step, k)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair
      type(step_t), intent(in) :: step
      integer, intent(in) :: k                   !! its number

      if (.not. step%scheme%takes_damping) then
         call refuse(reader, pair, "SCHEME=" // trim(step%scheme%word) // " of step " // &
            to_text(k) // &
            "; use SCHEME=ENERGY MOMENTUM, MIDPOINT or ENERGY DECAYING")
         return
      end if
      if (step_initiation(step) == initiation_velocity_update) then
         call refuse(reader, pair, "*CONTACT INITIATION, TYPE=VELOCITY UPDATE of step " // &
            to_text(k) // ": jumps of velocities have no friction")
      end if
      if (pair%interaction%pressure%kind /= pressure_hard) return
      if (.not. any(step%contact%method == [method_null_space, method_saddle_point])) then
         call refuse(reader, pair, "contact by a penalty, in step " // to_text(k) // "; use " // &
            "*CONSTRAINT METHOD, TYPE=NULL SPACE")
      end if
   end subroutine check_step

   !> The error of a pair whose friction does not go with `what`.
   subroutine refuse(reader, pair, what)
      type(reader_t), intent(inout) :: reader
      type(contact_pair_t), intent(in) :: pair
      character(len=*), intent(in) :: what

      call add_error(reader%log, pair%origin, "*CONTACT PAIR: its surface interaction has " &
         // "*FRICTION, which does not go with " // what)
   end subroutine refuse

end module emcon_deck_friction
