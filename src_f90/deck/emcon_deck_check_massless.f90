!> Sections without inertia: what they need in dynamic steps, and which contact.
module emcon_deck_check_massless
   use emcon_deck_check_surfaces, only : mark_nodes
   use emcon_deck_reader, only : reader_t
   use emcon_diagnostics, only : add_error, add_warning
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless, initiation_velocity_update, step_initiation, &
      step_is_dynamic
   implicit none
   private
   public :: check_massless_sections, has_massless_sections, mark_inertia

contains

   !> Is there a section without inertia?
   pure logical function has_massless_sections(scene) result(has_some)
      type(scene_t), intent(in) :: scene

      has_some = any(scene%section%is_massless)
   end function has_massless_sections

   !> Materials whose density makes inertia: that of a section which is not MASSLESS.
   pure subroutine mark_inertia(scene, has_inertia)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: has_inertia(:)    !! (materials)

      allocate(has_inertia(size(scene%material)), source=.false.)
      associate (section => scene%section)
         has_inertia(pack(section%material, section%material > 0 .and. .not. section%is_massless)) &
            = .true.
      end associate
   end subroutine mark_inertia

   !> Something has inertia, and contact on what has none begins in a way that needs none.
   subroutine check_massless_sections(reader, scene)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_massless(:), is_bare(:), meets(:)
      type(origin_t) :: origin
      integer :: k

      if (reader%doubt%nodes .or. reader%doubt%elements) return
      if (reader%doubt%names .or. reader%doubt%rigid) return
      if (any(scene%element%section == 0) .or. .not. allocated(scene%step)) return
      is_massless = scene%section(scene%element%section)%is_massless
      if (.not. any(is_massless)) return
      k = scene%element%section(findloc(is_massless, .true., 1))
      origin = scene%section(k)%origin
      if (.not. any(step_is_dynamic(scene%step))) then
         call add_warning(reader%log, origin, "MASSLESS has no effect: there is no *DYNAMIC step")
         return
      end if
      if (all(is_massless) .and. .not. allocated(scene%host%node)) call add_error(reader%log, &
         origin, "all sections are MASSLESS: nothing has inertia; use *STATIC")
      do k = 1, size(scene%rigid)
         if (any(is_massless(scene%rigid(k)%element))) call add_error(reader%log, &
            scene%rigid(k)%origin, "rigid body " // scene%rigid(k)%name // " has a MASSLESS " // &
            "section: a rigid body needs a mass")
      end do
      do k = 1, size(scene%step)
         associate (scheme => scene%step(k)%scheme)
            if (.not. scheme%takes_massless) call add_error(reader%log, &
               scene%step(k)%choice%origin, "SCHEME=" // trim(scheme%word) // " does not go " // &
               "with MASSLESS sections; use SCHEME=ENERGY MOMENTUM")
         end associate
      end do
      call mark_bare(scene, is_massless, is_bare)
      allocate(meets(size(is_bare)), source=.false.)
      call mark_nodes(scene, [scene%pair%slave, scene%pair%master], meets)
      if (.not. any(meets .and. is_bare)) return
      do k = 1, size(scene%step)
         call check_step(reader, scene, k, is_bare)
      end do
   end subroutine check_massless_sections

   !> What is restored in a step by a jump of velocities goes along forces on masses.
   subroutine check_step(reader, scene, k, is_bare)
      type(reader_t), intent(inout) :: reader
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k                   !! of a step
      logical, intent(in) :: is_bare(:)          !! (n_node)
      logical, allocatable :: is_joined(:)

      associate (step => scene%step(k))
         if (step_initiation(step) == initiation_velocity_update) call add_error(reader%log, &
            step%origin, "*CONTACT INITIATION, TYPE=VELOCITY UPDATE needs masses, but a surface " &
            // "in contact is of a MASSLESS section; use PERSISTENT or MASSLESS")
         if (step_initiation(step) /= initiation_massless) return
         call mark_joined(scene, is_joined)
         if (any(is_joined .and. is_bare)) call add_error(reader%log, step%origin, &
            "*CONTACT INITIATION, TYPE=MASSLESS is not for MASSLESS sections in contact that " // &
            "are also in a *TIE or an *EQUATION; use PERSISTENT")
      end associate
   end subroutine check_step

   !> Nodes of massless elements alone.
   pure subroutine mark_bare(scene, is_massless, is_bare)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_massless(:)              !! (n_element)
      logical, allocatable, intent(out) :: is_bare(:)    !! (n_node)
      integer :: pass, e

      allocate(is_bare(size(scene%x, 2)), source=.false.)
      do pass = 1, 2
         do e = 1, size(is_massless)
            if (is_massless(e) .neqv. pass == 1) cycle
            is_bare(pack(scene%element%node(:, e), scene%element%node(:, e) > 0)) = pass == 1
         end do
      end do
   end subroutine mark_bare

   !> Nodes of ties and equations.
   pure subroutine mark_joined(scene, is_joined)
      type(scene_t), intent(in) :: scene
      logical, allocatable, intent(out) :: is_joined(:)  !! (n_node)
      integer :: i

      allocate(is_joined(size(scene%x, 2)), source=.false.)
      call mark_nodes(scene, [scene%tie%slave, scene%tie%master], is_joined)
      do i = 1, size(scene%equation)
         is_joined(scene%equation(i)%node) = .true.
      end do
   end subroutine mark_joined

end module emcon_deck_check_massless
