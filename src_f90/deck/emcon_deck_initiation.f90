!> How contact begins in dynamic steps that leave it to the program.
!>
!> Source: docs/theory.md, section 6.4.
module emcon_deck_initiation
   use emcon_bodies, only : bodies_find
   use emcon_deck_check_massless, only : has_massless_sections
   use emcon_deck_jacobian, only : determinant
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error
   use emcon_interactions, only : contact_pair_t, formulation_user, pair_has_order, pressure_hard
   use emcon_kinds, only : wp
   use emcon_massless_surfaces, only : most_moved, nodes_that_keep_mass, pair_keeps_mass, &
      surface_keeps_mass
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_scene_motions, only : scene_is_flat
   use emcon_scheme_registry, only : scheme_user
   use emcon_shape, only : shape_table_t, shape_tabulate
   use emcon_steps, only : initiation_auto, initiation_massless, initiation_persistent, &
      method_null_space, method_saddle_point, step_is_dynamic, step_t
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : to_text
   implicit none
   private
   public :: choose_initiation

contains

   !> Settle how contact begins in steps that are AUTO, and tell why. Further steps of a run that
   !> goes on follow those that it has done: mass does not come and go.
   subroutine choose_initiation(reader, scene)
      type(reader_t), intent(inout) :: reader    !! after all steps have been read
      type(scene_t), intent(inout) :: scene
      type(step_t), allocatable :: step(:)
      logical :: keeps(size(scene%node%label))
      integer :: first, n

      n = count(scene%step%origin%file <= scene%deck%n_own_file)
      first = findloc(step_is_dynamic(scene%step(:n)), .true., 1)
      if (first == 0 .or. n == size(scene%step)) then
         call settle(reader, scene)
         return
      end if
      step = scene%step
      scene%step = step(:n)
      call settle(reader, scene)
      keeps = nodes_that_keep_mass(scene)
      step(:n)%contact%initiation = scene%step%contact%initiation
      where (step(n + 1:)%contact%initiation == initiation_auto) &
         step(n + 1:)%contact%initiation = step(first)%contact%initiation
      call move_alloc(step, scene%step)
      if (scene%step(first)%contact%initiation == initiation_massless) then
         call check_held(reader, scene, scene%step(n + 1)%origin, keeps)
      end if
   end subroutine choose_initiation

   !> What has no mass by now cannot be held in further steps: it would get its mass back, and with
   !> it an energy.
   subroutine check_held(reader, scene, origin, kept)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      type(origin_t), intent(in) :: origin       !! of the first further step
      logical, intent(in) :: kept(:)             !! (n_node) their mass before
      integer :: i

      i = findloc(contact_nodes(scene) .and. nodes_that_keep_mass(scene) .and. .not. kept, &
         .true., 1)
      if (i > 0) call add_error(reader%log, origin, "node " // to_text(scene%node%label(i)) // &
         " of a contact surface, which has no mass in the run so far, is held or driven in a " // &
         "further step; begin anew with all steps in the deck, or with *CONTACT INITIATION, " // &
         "TYPE=PERSISTENT")
   end subroutine check_held

   !> MASSLESS where that serves all dynamic steps, PERSISTENT elsewhere.
   pure subroutine settle(reader, scene)
      type(reader_t), intent(in) :: reader
      type(scene_t), intent(inout) :: scene
      logical, dimension(size(scene%step)) :: is_auto, is_dynamic
      character(len=:), allocatable :: reason
      integer :: i

      is_dynamic = step_is_dynamic(scene%step)
      is_auto = scene%step%contact%initiation == initiation_auto
      if (any(is_dynamic .and. scene%step%contact%initiation == initiation_massless)) then
         where (is_auto) scene%step%contact%initiation = initiation_massless
         return
      end if
      where (is_auto) scene%step%contact%initiation = initiation_persistent
      if (reader%log%n_errors > 0 .or. size(scene%pair) == 0) return
      if (.not. any(is_auto .and. is_dynamic)) return
      if (.not. all(is_auto .or. .not. is_dynamic)) return
      call find_reason(scene, reason)
      scene%deck%keeps_mass = reason
      if (len(reason) > 0) return
      where (is_dynamic) scene%step%contact%initiation = initiation_massless
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i))
            if (pair%initiation == 0 .and. pair_has_order(pair) .and. &
               surface_keeps_mass(scene, pair%slave)) pair%initiation = initiation_persistent
         end associate
      end do
   end subroutine settle

   !> Why the surfaces of contact keep their mass; "" if nothing speaks for that.
   pure subroutine find_reason(scene, reason)
      type(scene_t), intent(in) :: scene
      character(len=:), allocatable, intent(out) :: reason
      real(wp), allocatable :: share(:)
      integer :: k

      reason = ""
      k = findloc(takes_massless(scene%step), .false., 1)
      if (k > 0) then
         reason = "the scheme or the constraint method of step " // to_text(k) // " needs them"
      else if (has_massless_sections(scene)) then
         reason = "there are MASSLESS sections"
      else if (any(scene%material%alpha > 0.0_wp .or. scene%material%beta > 0.0_wp)) then
         reason = "there is *DAMPING of materials"
      end if
      do k = 1, size(scene%pair)
         if (len(reason) == 0) call find_reason_of(scene%pair(k), reason)
      end do
      if (len(reason) > 0) return
      call find_shares(scene, share)
      k = maxloc(share, 1)
      if (.not. share(k) > 0.0_wp) then
         reason = "no node of the surfaces can lose its own"
      else if (share(k) > most_moved) then
         reason = "body " // to_text(k) // " has " // to_text(100.0_wp*share(k), 2) // " % of " // &
            "its mass at nodes of contact, more than " // to_text(100.0_wp*most_moved, 2) // " %"
      end if
   end subroutine find_reason

   !> May nodes be without mass in a step?
   elemental logical function takes_massless(step)
      type(step_t), intent(in) :: step

      takes_massless = .not. step_is_dynamic(step) .or. (step%scheme%takes_massless .and. &
         step%scheme%code /= scheme_user .and. .not. step%scheme%lumps_mass .and. &
         any(step%contact%method == [method_null_space, method_saddle_point]))
   end function takes_massless

   !> What nodes without mass do not have, of a pair; "" if it says nothing of that kind.
   pure subroutine find_reason_of(pair, reason)
      type(contact_pair_t), intent(in) :: pair
      character(len=:), allocatable, intent(inout) :: reason     !! stays "" so

      if (pair%initiation /= 0) then
         reason = "a *CONTACT PAIR has INITIATION="
      else if (pair%interaction%pressure%kind /= pressure_hard) then
         reason = "a contact has a pressure by its overclosure"
      else if (pair%interaction%restitution < 1.0_wp) then
         reason = "a contact has a RESTITUTION"
      else if (pair_keeps_mass(pair)) then
         reason = "a contact has *CONTACT DAMPING, or friction and a restitution"
      else if (pair%formulation == formulation_user .or. any([pair%slave, pair%master] == 0)) then
         reason = "a program gives a contact"
      end if
   end subroutine find_reason_of

   !> The part of the mass of each body that its nodes of contact would lose.
   pure subroutine find_shares(scene, share)
      type(scene_t), intent(in) :: scene
      real(wp), allocatable, intent(out) :: share(:)     !! (n_body)
      logical :: meets(size(scene%node%label))
      integer, allocatable :: body(:), node(:)   !! `body`: (n_node)
      real(wp), allocatable :: total(:)          !! (n_body) [M]
      real(wp) :: mass
      integer :: e, n_body

      meets = contact_nodes(scene) .and. .not. nodes_that_keep_mass(scene)
      call bodies_find(scene%element%node, size(meets), body, n_body)
      allocate(share(n_body), total(n_body), source=0.0_wp)
      do e = 1, size(scene%element%kind)
         node = pack(scene%element%node(:, e), scene%element%node(:, e) > 0)
         if (size(node) == 0) cycle
         mass = element_mass(scene, e)
         associate (b => body(node(1)))
            total(b) = total(b) + mass
            share(b) = share(b) + mass*count(meets(node))/size(node)
         end associate
      end do
      where (total > 0.0_wp) share = share/total
   end subroutine find_shares

   !> The nodes of all surfaces of contact.
   pure function contact_nodes(scene) result(meets)
      type(scene_t), intent(in) :: scene
      logical :: meets(size(scene%node%label))   !! (n_node)
      integer, allocatable :: node(:)
      integer :: k

      meets = .false.
      do k = 1, size(scene%surface)
         if (.not. any([scene%pair%slave, scene%pair%master] == k)) cycle
         call surface_nodes(scene, scene%surface(k), node)
         meets(node) = .true.
      end do
   end function contact_nodes

   !> Mass of element `e`; 0 of one whose shape a program gives.
   pure real(wp) function element_mass(scene, e) result(mass)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      type(shape_table_t) :: table
      real(wp) :: thickness
      integer :: i

      mass = 0.0_wp
      associate (kind => scene%element%kinds(scene%element%kind(e)), &
            section => scene%element%section(e))
         if (.not. allocated(kind%shape) .or. section == 0) return
         if (scene%section(section)%material == 0) return
         thickness = merge(scene%section(section)%thickness, 1.0_wp, scene_is_flat(scene))
         call shape_tabulate(kind%shape, .true., table)
         associate (x => scene%x(:, scene%element%node(:table%n_node, e)), &
               density => scene%material(scene%section(section)%material)%density)
            do i = 1, table%n_gp
               mass = mass + thickness*density*table%weight(i)*determinant(matmul(x, &
                  transpose(table%slope(:, :, i))))
            end do
         end associate
      end associate
   end function element_mass

end module emcon_deck_initiation
