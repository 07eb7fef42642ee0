!> Models that are given forces and mass: lines of nodes, and scenes with elements of a host.
module given_scenes
   use check, only : check_near
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_errors, only : error_t
   use emcon_host_force, only : host_force_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_scene, only : scene_t
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_is_done, stepper_t
   use emcon_stepper_user, only : stepper_give_force, stepper_give_mass
   use emcon_surface_facets, only : surface_facets
   use emcon_system, only : system_init, system_t
   use emcon_term_registry, only : terms_mass
   use emcon_text, only : to_text
   use given_hosts, only : solid_host_init, solid_host_t
   use small_scenes, only : add_step, scene_begin
   implicit none
   private
   public :: keep_elements, make_line, lump, open_given, open_both, run_conserving, given_eps

   !> The solvers compute in double precision, whatever the state is.
   real(wp), parameter :: given_eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   !> Take all elements but those of `is_kept` away from `scene`; surfaces of them become surfaces
   !> of edges.
   subroutine keep_elements(scene, is_kept)
      type(scene_t), intent(inout) :: scene
      logical, intent(in) :: is_kept(:)
      integer, allocatable :: edge(:, :), kept(:)
      integer :: number(size(is_kept)), i

      kept = pack([(i, i = 1, size(is_kept))], is_kept)
      number = 0
      number(kept) = [(i, i = 1, size(kept))]
      do i = 1, size(scene%surface)
         if (all(is_kept(scene%surface(i)%element))) then
            scene%surface(i)%element = number(scene%surface(i)%element)
         else
            call surface_facets(scene, scene%surface(i), edge)
            scene%surface(i)%edge = edge
            scene%surface(i)%element = [integer ::]
            scene%surface(i)%face = [integer ::]
         end if
      end do
      scene%element%label = scene%element%label(kept)
      scene%element%origin = scene%element%origin(kept)
      scene%element%kind = scene%element%kind(kept)
      scene%element%node = scene%element%node(:, kept)
      scene%element%section = scene%element%section(kept)
   end subroutine keep_elements

   !> `scene` with elements, and the same with the elements but those of `is_kept` as those of a
   !> host.
   subroutine open_both(scene, is_kept, tells_magnitude, own, hosted, error)
      type(scene_t), intent(in) :: scene
      logical, intent(in) :: is_kept(:)          !! (n_element)
      logical, intent(in) :: tells_magnitude
      type(stepper_t), intent(inout) :: own, hosted
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: part
      type(solid_host_t) :: host
      type(system_t) :: system
      type(csr_t) :: mass

      own%scene = scene
      own%is_read = .true.
      call stepper_build(own, error)
      if (allocated(error)) return
      part = own%scene                           ! ties have moved nodes
      part%pair = part%pair(:0)
      call keep_elements(part, .not. is_kept)
      call solid_host_init(host, part, error)
      if (.not. allocated(error)) call system_init(system, part, error)
      if (allocated(error)) return
      host%tells_magnitude = tells_magnitude
      hosted%scene = scene
      call keep_elements(hosted%scene, is_kept)
      hosted%is_read = .true.
      call stepper_give_force(hosted, host, error)
      if (.not. allocated(error)) call terms_mass(system%term, mass)
      if (.not. allocated(error)) call stepper_give_mass(hosted, mass, error)
      if (.not. allocated(error)) call stepper_build(hosted, error)
   end subroutine open_both

   !> `n` nodes along x, one apart from the other, that only move along x; one step.
   subroutine make_line(scene, n, is_static, h, n_increment)
      type(scene_t), intent(out) :: scene
      integer, intent(in) :: n
      logical, intent(in) :: is_static
      real(wp), intent(in) :: h
      integer, intent(in) :: n_increment
      integer :: i

      call scene_begin(scene)
      deallocate(scene%x, scene%u0, scene%v0, scene%node%origin)
      allocate(scene%x(2, n), scene%u0(2, n), scene%v0(2, n), source=0.0_wp)
      allocate(scene%node%origin(n))
      scene%x(1, :) = [(real(i, wp), i = 1, n)]
      scene%node%label = [(10*i, i = 1, n)]
      call add_step(scene, is_static, h, n_increment)
   end subroutine make_line

   !> Masses of `mass` at `n` nodes.
   subroutine lump(mass, n, size_of)
      type(csr_t), intent(out) :: mass
      integer, intent(in) :: n
      real(wp), intent(in) :: size_of
      type(error_t), allocatable :: error
      integer, allocatable :: slot(:)
      integer :: i

      call csr_from_elements(mass, n, [(i, i = 1, n + 1)], [(i, i = 1, n)], slot, error)
      mass%value = real(size_of, dp)
   end subroutine lump

   subroutine open_given(stepper, scene, force, mass, error)
      type(stepper_t), intent(inout) :: stepper
      type(scene_t), intent(in) :: scene
      class(host_force_t), intent(in) :: force
      real(wp), intent(in) :: mass               !! of each node; 0: none
      type(error_t), allocatable, intent(out) :: error
      type(csr_t) :: matrix

      stepper%scene = scene
      stepper%is_read = .true.
      call stepper_give_force(stepper, force, error)
      if (allocated(error)) return
      call lump(matrix, size(scene%x, 2), mass)
      if (mass > 0.0_wp) call stepper_give_mass(stepper, matrix, error)
      if (.not. allocated(error)) call stepper_build(stepper, error)
   end subroutine open_given

   !> Run to the end; the total energy stays but for `steps` times 32 given_eps of `scale`.
   subroutine run_conserving(stepper, scale, error)
      type(stepper_t), intent(inout) :: stepper
      real(wp), intent(in) :: scale
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: increment
      real(wp) :: total
      integer :: k

      total = stepper%march%ledger%total
      k = 0
      do while (.not. stepper_is_done(stepper))
         k = k + 1
         call stepper_advance(stepper, increment, error)
         if (allocated(error)) return
         call check_near(error, stepper%march%ledger%total, total, 32.0_wp*real(k, wp)*given_eps, &
            scale, "total energy in step " // to_text(k))
         if (allocated(error)) return
      end do
   end subroutine run_conserving

end module given_scenes
