!> The kinds of terms, and those of them that are asked for by name.
submodule (emcon_term_registry) emcon_term_kinds
   use emcon_corotated_term, only : corotated_term_init, corotated_term_t
   use emcon_dissipation, only : dissipation_term_init, dissipation_term_t
   use emcon_host_check, only : host_check_mass
   use emcon_host_term, only : host_term_init, host_term_t
   use emcon_inertia, only : inertia_add, inertia_init, inertia_t, inertia_times, &
      inertia_mass, inertia_values
   use emcon_linear_term, only : linear_term_init, linear_term_t
   use emcon_loads, only : loads_init, loads_t
   use emcon_materials, only : kinematics_corotated, kinematics_linear
   use emcon_massless, only : massless_bare, massless_find, massless_return, massless_shed
   use emcon_solid_term, only : solid_term_init, solid_term_t
   use emcon_stabilization, only : stabilization_force, stabilization_term_init, &
      stabilization_term_t
   implicit none

   !> Where the terms that every model has stand; what is given comes after them.
   integer, parameter :: of_inertia = 1, of_solid = 2, of_loads = 3, n_own = 3

contains

   module procedure terms_create
      integer :: n, i, first
      logical :: has_linear, turns               ! there are linear elements, corotated ones
      logical :: decays                          ! elements take energy
      logical :: stabilizes                      ! a static step is damped

      n = 0
      if (present(host)) then
         if (allocated(host%force)) n = size(host%force)
      end if
      has_linear = any(scene%section(scene%element%section)%kinematics == kinematics_linear)
      turns = any(scene%section(scene%element%section)%kinematics == kinematics_corotated)
      decays = any(scene%step%scheme%dissipates) .or. any(scene%material%alpha > 0.0_wp .or. &
         scene%material%beta > 0.0_wp)
      stabilizes = any(scene%step%stabilization > 0.0_wp)
      first = n_own + count([has_linear, turns, decays, stabilizes])
      allocate(term(first + n))
      allocate(inertia_t :: term(of_inertia)%term)
      allocate(solid_term_t :: term(of_solid)%term)
      allocate(loads_t :: term(of_loads)%term)
      if (has_linear) allocate(linear_term_t :: term(n_own + 1)%term)
      if (turns) allocate(corotated_term_t :: term(n_own + count([has_linear, turns]))%term)
      if (decays) allocate(dissipation_term_t :: term(n_own &
         + count([has_linear, turns, decays]))%term)
      if (stabilizes) allocate(stabilization_term_t :: term(first)%term)
      call create_own(scene, term, error, host)
      do i = 1, n
         if (allocated(error)) return
         allocate(host_term_t :: term(first + i)%term)
         select type (part => term(first + i)%term)
         type is (host_term_t)
            call host_term_init(part, host%force(i)%force, scene, error)
         end select
      end do
   end procedure terms_create

   !> The elements, and the terms that stand on them.
   subroutine create_own(scene, term, error, host)
      type(scene_t), intent(in) :: scene
      type(term_box_t), intent(inout), target :: term(:)
      type(error_t), allocatable, intent(out) :: error
      type(host_t), intent(in), optional :: host
      type(csr_t) :: extra
      type(solid_t), pointer :: solid
      integer :: i
      logical, dimension(size(scene%x, 2)) :: without_density, is_massless, is_given

      select type (part => term(of_solid)%term)
      type is (solid_term_t)
         if (present(host)) then
            call solid_term_init(part, scene, error, host%law)
            extra = host%mass
         else
            call solid_term_init(part, scene, error)
         end if
      end select
      if (.not. allocated(error) .and. extra%n_row > 0) call host_check_mass(extra, scene, error)
      if (allocated(error)) return
      solid => terms_solid(term)
      call mark_given(size(scene%x, 1), extra, is_given, host)
      call massless_bare(scene, solid, is_given, without_density)
      call massless_find(scene, solid, is_given, without_density, is_massless)
      if (any(is_massless)) call massless_shed(solid, is_massless)
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         call inertia_init(part, solid, size(scene%x, 1), extra, error)
         part%is_massless = is_massless
         part%without_density = without_density
      end select
      select type (part => term(of_loads)%term)
      type is (loads_t)
         call loads_init(part, scene, solid)
      end select
      do i = n_own + 1, size(term)
         if (.not. allocated(term(i)%term) .or. allocated(error)) exit
         select type (part => term(i)%term)
         type is (linear_term_t)
            call linear_term_init(part, solid, size(scene%x, 1), error)
         type is (corotated_term_t)
            call corotated_term_init(part, solid, size(scene%x, 1))
         type is (dissipation_term_t)
            call dissipation_term_init(part, solid, scene)
         type is (stabilization_term_t)
            call stabilization_term_init(part, solid)
         end select
      end do
   end subroutine create_own

   !> The nodes that mass or forces are given for.
   pure subroutine mark_given(n_dim, mass, is_given, host)
      integer, intent(in) :: n_dim
      type(csr_t), intent(in) :: mass            !! (n_node x n_node); without rows: none
      logical, intent(out) :: is_given(:)        !! (n_node)
      type(host_t), intent(in), optional :: host
      integer :: i, k

      is_given = .false.
      do i = 1, mass%n_row
         is_given(i) = mass%row_start(i + 1) > mass%row_start(i)
      end do
      if (.not. present(host)) return
      if (.not. allocated(host%force)) return
      do k = 1, size(host%force)
         associate (pattern => host%force(k)%force%pattern)
            do i = 1, pattern%n_row
               if (pattern%row_start(i + 1) > pattern%row_start(i)) is_given((i - 1)/n_dim + 1) = &
                  .true.
            end do
         end associate
      end do
   end subroutine mark_given

   module procedure terms_solid
      nullify(solid)
      select type (part => term(of_solid)%term)
      type is (solid_term_t)
         solid => part%solid
      end select
   end procedure terms_solid

   module procedure terms_mass
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         call inertia_mass(part, mass)
      end select
   end procedure terms_mass

   module procedure terms_mass_rows
      type(csr_t) :: between
      integer :: i

      call terms_mass(term, between)
      mass = 0.0_wp
      do i = 1, between%n_row
         mass(i) = real(sum(between%value(between%row_start(i) + 1:between%row_start(i + 1))), wp)
      end do
   end procedure terms_mass_rows

   module procedure terms_massless
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         is_massless = part%is_massless
         without_density = part%without_density
      end select
   end procedure terms_massless

   module procedure terms_return_mass
      type(solid_t), pointer :: solid
      type(csr_t) :: relative

      solid => terms_solid(term)
      call massless_return(solid, may_be_massless, has_mass, relative, error)
      if (allocated(error)) return
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         part%is_massless = may_be_massless .and. .not. has_mass
         call inertia_add(part, solid, relative, error)
      end select
   end procedure terms_return_mass

   module procedure terms_mass_values
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         call inertia_values(part, value)
      end select
   end procedure terms_mass_values

   module procedure terms_dissipation
      integer :: k

      work = 0.0_wp
      damping = 0.0_wp
      do k = 1, size(term)
         select type (part => term(k)%term)
         type is (dissipation_term_t)
            work = part%work
            damping = part%damping
         end select
      end do
   end procedure terms_dissipation

   module procedure terms_stabilization
      integer :: k

      work = 0.0_wp
      if (present(force)) force = 0.0_wp
      do k = 1, size(term)
         select type (part => term(k)%term)
         type is (stabilization_term_t)
            work = part%work
            if (present(force)) call stabilization_force(part, force)
         end select
      end do
   end procedure terms_stabilization

   module procedure terms_mass_times
      select type (part => term(of_inertia)%term)
      type is (inertia_t)
         call inertia_times(part, field, product)
      end select
   end procedure terms_mass_times

end submodule emcon_term_kinds
