!> The C functions that tell what a model holds, in Fortran. What each does is said in emcon.h.
module emcon_model_state
   use, intrinsic :: iso_c_binding, only : c_double
   use emcon_c_types, only : ledger_c
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : dp, wp
   use emcon_model, only : model_t
   use emcon_pair_record, only : pair_components
   use emcon_quantities, only : contact_quantity
   use emcon_report_row, only : report_rows_t, rows_json
   use emcon_scene_report, only : scene_report
   use emcon_stepper, only : stepper_fraction, stepper_is_done
   use emcon_text, only : to_upper
   use emcon_verdict_file, only : verdict_so_far
   implicit none
   private
   public :: model_time, model_progress, model_ledger, model_verdict, model_notes, model_report
   public :: model_find_nodes, model_labels, model_positions
   public :: model_state, model_get_multipliers, model_contact, model_pressures, model_pairs, &
      model_friction, model_pair_friction

contains

   pure subroutine model_time(model, time)
      type(model_t), intent(in) :: model
      real(wp), intent(out) :: time

      time = model%stepper%march%state%clock%time
   end subroutine model_time

   subroutine model_progress(model, fraction, t_end)
      type(model_t), intent(in) :: model
      real(wp), intent(out) :: fraction, t_end

      fraction = 1.0_wp
      if (.not. stepper_is_done(model%stepper)) fraction = stepper_fraction(model%stepper)
      t_end = sum(model%stepper%scene%step%time%duration)
   end subroutine model_progress

   pure subroutine model_ledger(model, ledger)
      type(model_t), intent(in) :: model
      type(ledger_c), intent(out) :: ledger
      integer, parameter :: x = 1, y = 2, z = 3
      real(c_double) :: p(z), l(z)                   !! momentum, angular momentum

      associate (from => model%stepper%march%ledger)
         ledger%kinetic = real(from%kinetic, c_double)
         ledger%strain = real(from%strain, c_double)
         ledger%potential = real(from%potential, c_double)
         ledger%external_work = real(from%external_work, c_double)
         ledger%contact_work = real(from%contact_work, c_double)
         ledger%total = real(from%total, c_double)
         ledger%stabilization = real(from%stabilization, c_double)
         ledger%restitution_loss = real(from%restitution, c_double)
         ledger%scheme_loss = real(from%decay, c_double)
         ledger%damping_loss = real(from%damping, c_double)
         ledger%contact_energy = real(from%contact_energy, c_double)
         ledger%friction_loss = real(from%friction, c_double)
         ledger%contact_damping_loss = real(from%contact_damping, c_double)
         p = 0.0_c_double
         l = 0.0_c_double
         p(:size(from%momentum)) = real(from%momentum, c_double)
         l(z + 1 - size(from%angular):) = real(from%angular, c_double)
      end associate
      ledger%px = p(x)
      ledger%py = p(y)
      ledger%pz = p(z)
      ledger%lx = l(x)
      ledger%ly = l(y)
      ledger%lz = l(z)
   end subroutine model_ledger

   subroutine model_verdict(model, is_good, json)
      type(model_t), intent(inout) :: model
      logical, intent(out) :: is_good
      character(len=:), allocatable, intent(out) :: json

      call verdict_so_far(model%stepper%verdict, model%stepper%march, json, is_good)
   end subroutine model_verdict

   pure subroutine model_notes(model, text)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(out) :: text     !! a line each
      integer :: i

      text = ""
      do i = 1, size(model%stepper%diagnostic)
         text = text // model%stepper%diagnostic(i)%text // new_line("a")
      end do
      do i = 1, model%stepper%notes%n
         text = text // model%stepper%notes%item(i)%text // new_line("a")
      end do
   end subroutine model_notes

   subroutine model_report(model, json)
      type(model_t), intent(inout) :: model
      character(len=:), allocatable, intent(out) :: json
      type(report_rows_t) :: rows

      call scene_report(model%stepper, rows)
      call rows_json(rows, json)
   end subroutine model_report

   pure subroutine model_find_nodes(model, name, is_in, error)
      type(model_t), intent(in) :: model
      character(len=*), intent(in) :: name
      logical, allocatable, intent(out) :: is_in(:)          !! (n_node)
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      associate (scene => model%stepper%scene)
         allocate(is_in(size(scene%x, 2)), source=.false.)
         do k = 1, size(scene%set%node)
            if (scene%set%node(k)%name == to_upper(name)) exit
         end do
         if (k > size(scene%set%node)) then
            call raise(error, err_input, "there is no node set " // name)
         else
            is_in(scene%set%node(k)%item) = .true.
         end if
      end associate
   end subroutine model_find_nodes

   pure subroutine model_labels(model, label)
      type(model_t), intent(in) :: model
      integer, allocatable, intent(out) :: label(:)          !! (n_node)

      allocate(label, source=model%stepper%scene%node%label)
   end subroutine model_labels

   pure subroutine model_positions(model, x)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: x(:, :)          !! (n_dim, n_node)

      allocate(x, source=model%stepper%scene%x)
   end subroutine model_positions

   pure subroutine model_state(model, u, v)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: u(:, :), v(:, :) !! (n_dim, n_node)

      allocate(u, source=model%stepper%march%state%u)
      allocate(v, source=model%stepper%march%state%v)
   end subroutine model_state

   pure subroutine model_get_multipliers(model, lam, is_active)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: lam(:)           !! (n_constraint)
      logical, allocatable, intent(out) :: is_active(:)      !! (n_constraint)

      call model%stepper%march%state%contacts%get(1, lam, is_active)
   end subroutine model_get_multipliers

   pure subroutine model_contact(model, lam, is_active, label, pair)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: lam(:)           !! (n_contact)
      logical, allocatable, intent(out) :: is_active(:)      !! (n_contact)
      integer, allocatable, intent(out) :: label(:), pair(:) !! (n_contact)
      integer :: i

      associate (system => model%stepper%march%system, state => model%stepper%march%state)
         call state%contacts%get(system%first_constraint(1) + 1, lam, is_active)
         allocate(label(0), pair(0))
         do i = 1, size(system%contact)
            associate (node => system%contact(i)%contact%node)
               label = [label, model%stepper%scene%node%label(node)]
               pair = [pair, spread(abs(system%contact(i)%of_pair), 1, size(node))]
            end associate
         end do
      end associate
   end subroutine model_contact

   subroutine model_pressures(model, pressure, gap)
      type(model_t), intent(inout) :: model
      real(wp), allocatable, intent(out) :: pressure(:), gap(:)    !! (n_contact)

      call pick("CSTR", pressure)
      call pick("CDIS", gap)

   contains

      !> The first component of a quantity, of contacts alone.
      subroutine pick(name, values)
         character(len=*), intent(in) :: name
         real(wp), allocatable, intent(out) :: values(:)
         real(dp), allocatable :: quantity(:, :)

         allocate(quantity, source=contact_quantity(model%stepper, name))
         values = real(quantity(1, model%stepper%march%system%first_constraint(1) + 1:), wp)
      end subroutine pick

   end subroutine model_pressures

   subroutine model_friction(model, shear, way, slip, path)
      type(model_t), intent(inout) :: model
      real(wp), allocatable, intent(out) :: shear(:, :), slip(:, :)      !! (n_slip, n_contact)
      real(wp), allocatable, intent(out) :: path(:)                      !! (n_contact)
      integer, allocatable, intent(out) :: way(:)                        !! (n_contact)
      real(dp), allocatable :: along(:, :), slid(:, :)
      integer :: first

      allocate(along, source=contact_quantity(model%stepper, "CSHEAR"))
      allocate(slid, source=contact_quantity(model%stepper, "CSLIP"))
      first = model%stepper%march%system%first_constraint(1) + 1
      associate (n => size(slid, 1))
         shear = real(along(:n - 1, first:), wp)
         way = nint(along(n, first:))
         slip = real(slid(:n - 1, first:), wp)
         path = real(slid(n, first:), wp)
      end associate
   end subroutine model_friction

   !> Pairs that are one in the sums have it at the first of them.
   pure subroutine model_pair_friction(model, loss)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: loss(:)          !! (n_pair)
      integer :: k

      associate (sums => model%stepper%march%state%sums)
         allocate(loss(model%stepper%march%system%n_pair), source=0.0_wp)
         do k = 1, size(loss)
            if (any(abs(sums%of_pair(:k - 1)) == abs(sums%of_pair(k)))) cycle
            loss(k) = sums%sum(abs(sums%of_pair(k)))%friction
         end do
      end associate
   end subroutine model_pair_friction

   pure subroutine model_pairs(model, total, n_active)
      type(model_t), intent(in) :: model
      real(wp), allocatable, intent(out) :: total(:, :)      !! (n_pair_total, n_pair)
      integer, allocatable, intent(out) :: n_active(:)       !! (n_pair)
      integer :: k

      associate (pair => model%stepper%march%state%pairs%total, &
            n => pair_components(model%stepper%march%state%pairs))
         allocate(total(2*n + 1, size(pair)), n_active(size(pair)))
         do k = 1, size(pair)
            total(:, k) = [pair(k)%slave(:n), pair(k)%master(:n), pair(k)%covered]
            n_active(k) = pair(k)%n_active
         end do
      end associate
   end subroutine model_pairs

end module emcon_model_state
