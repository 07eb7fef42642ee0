!> Calls of a step for codes in the manner of Fortran 77; see emcon_legacy, and emcon_interface_step
!> for what they do. U0(2,N): displacements at the start of the step; DU(2,N): the motion in it.
module emcon_legacy_step
   use, intrinsic :: iso_c_binding, only : c_double, c_int, c_int64_t
   use emcon_contact, only : gap_state_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_interface_handle, only : handle_size, host_contacts, host_find, host_fit, &
      host_index, host_pass, host_put, host_selected, host_t, host_unknowns
   use emcon_interface_null_space, only : interface_multipliers, interface_null_space, &
      interface_particular
   use emcon_interface_step, only : interface_begin_step, interface_curvature, interface_drop, &
      interface_evaluate, interface_gaps, interface_second_times, interface_select, &
      interface_update_active
   use emcon_kinds, only : wp
   implicit none
   private
   public :: embeg, emgap, emsel, emeval, emcurv, emtime, emupd, emdrop, emnull, emlam, empart

contains

   !> Begin a step. IWAS(M): contacts that acted before; IACT(M): those that still can.
   subroutine embeg(ih, n, m, u0, du, iwas, iact, ierr) bind(c, name="embeg_")
      integer(c_int), intent(in) :: ih(handle_size), n, m
      real(c_double), intent(in) :: u0(2, n), du(2, n)
      integer(c_int), intent(in) :: iwas(m)
      integer(c_int), intent(out) :: iact(m), ierr
      type(host_t), pointer :: host
      logical, allocatable :: active(:)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMBEG", error, n=n, m=m)
      if (.not. allocated(error)) then
         allocate(active(max(0, host_contacts(host))))
         call interface_begin_step(host%face, real(u0, wp), real(du, wp), iwas /= 0, active, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) iact = merge(1, 0, active)
   end subroutine embeg

   !> All gaps at the start, G0(M), and at the end of the step, G1(M), where NEAR(M) is 1: there is
   !> a surface near.
   subroutine emgap(ih, n, m, u0, du, near, g0, g1, ierr) bind(c, name="emgap_")
      integer(c_int), intent(in) :: ih(handle_size), n, m
      real(c_double), intent(in) :: u0(2, n), du(2, n)
      integer(c_int), intent(out) :: near(m)
      real(c_double), intent(out) :: g0(m), g1(m)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(gap_state_t), allocatable :: state(:)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMGAP", error, n=n, m=m)
      if (.not. allocated(error)) then
         allocate(state(max(0, host_contacts(host))))
         call interface_gaps(host%face, real(u0, wp), real(du, wp), state, error)
      end if
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      near = merge(1, 0, state%is_near)
      g0 = real(state%gap0, c_double)
      g1 = real(state%gap1, c_double)
   end subroutine emgap

   !> Select the contacts IACT(M). There are K; ID(M) are their numbers, ascending, TARGET(M) the
   !> gaps that they hold.
   subroutine emsel(ih, n, m, u0, du, iact, k, id, target, ierr) bind(c, name="emsel_")
      integer(c_int), intent(in) :: ih(handle_size), n, m
      real(c_double), intent(in) :: u0(2, n), du(2, n)
      integer(c_int), intent(in) :: iact(m)
      integer(c_int), intent(out) :: k, id(m)
      real(c_double), intent(out) :: target(m)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      k = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMSEL", error, n=n, m=m)
      if (.not. allocated(error)) call interface_select(host%face, real(u0, wp), real(du, wp), &
         iact /= 0, error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      id = 0
      target = 0.0_c_double
      associate (set => host%face%active%set)
         k = set%n
         id(:k) = set%id
         target(:k) = real(set%target, c_double)
      end associate
   end subroutine emsel

   !> The K selected contacts: rows of discrete gradients G and of gradients at the end C, one
   !> pattern over 2 N freedoms; DEFECT(K) is to become 0, DGAP(K) is the change of the gap.
   subroutine emeval(ih, n, k, u0, du, maxnz, nz, irow, icol, g, c, defect, dgap, ierr) &
      bind(c, name="emeval_")
      integer(c_int), intent(in) :: ih(handle_size), n, k
      real(c_double), intent(in) :: u0(2, n), du(2, n)
      integer(c_int), intent(in) :: maxnz
      integer(c_int), intent(out) :: nz, irow(k + 1_c_int64_t), icol(maxnz)
      real(c_double), intent(out) :: g(maxnz), c(maxnz), defect(k), dgap(k)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      nz = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMEVAL", error, n=n)
      call host_fit("EMEVAL: K", k, host%face%active%set%n, error)
      if (.not. allocated(error)) call interface_evaluate(host%face, real(u0, wp), real(du, wp), &
         host%values, error)
      if (.not. allocated(error)) call host_put(host%values%g, irow, icol, g, nz, error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      c(:nz) = real(host%values%c%value(:nz), c_double)
      defect = real(host%values%defect, c_double)
      dgap = real(host%values%dgap, c_double)
   end subroutine emeval

   !> Sum of ALAM(I) times the derivative of row I of G by the motion, 2 N rows.
   subroutine emcurv(ih, k, alam, n, maxnz, nz, irow, icol, val, ierr) bind(c, name="emcurv_")
      integer(c_int), intent(in) :: ih(handle_size), k
      real(c_double), intent(in) :: alam(k)
      integer(c_int), intent(in) :: n, maxnz
      integer(c_int), intent(out) :: nz, irow(2_c_int64_t*n + 1), icol(maxnz)
      real(c_double), intent(out) :: val(maxnz)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(csr_t) :: matrix
      type(error_t), allocatable :: error

      nz = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMCURV", error, n=n, k=k)
      if (.not. allocated(error)) call interface_curvature(host%face, real(alam, wp), matrix, error)
      if (.not. allocated(error)) call host_put(matrix, irow, icol, val, nz, error)
      call host_pass(host, error, ierr)
   end subroutine emcurv

   !> The same times DIR(2,N): PROD(2,N).
   subroutine emtime(ih, k, alam, n, dir, prod, ierr) bind(c, name="emtime_")
      integer(c_int), intent(in) :: ih(handle_size), k
      real(c_double), intent(in) :: alam(k)
      integer(c_int), intent(in) :: n
      real(c_double), intent(in) :: dir(2, n)
      real(c_double), intent(out) :: prod(2, n)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      real(wp), allocatable :: product(:, :)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMTIME", error, n=n, k=k)
      if (.not. allocated(error)) then
         allocate(product(2, n))
         call interface_second_times(host%face, real(alam, wp), real(dir, wp), product, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) prod = real(product, c_double)
   end subroutine emtime

   !> The next set IACT(M) after the step was solved with the selected one; IDONE = 1: it stands,
   !> or ISTAT is not 0: 5 the sets go in circles, 6 the step is too large, 7 contact would begin
   !> too far off. AMAG(2,N): sums of |contributions| to the residual; zeros if not known.
   subroutine emupd(ih, n, m, u0, du, k, alam, amag, iact, idone, istat, ierr) &
      bind(c, name="emupd_")
      integer(c_int), intent(in) :: ih(handle_size), n, m
      real(c_double), intent(in) :: u0(2, n), du(2, n)
      integer(c_int), intent(in) :: k
      real(c_double), intent(in) :: alam(k), amag(2, n)
      integer(c_int), intent(inout) :: iact(m)
      integer(c_int), intent(out) :: idone, istat, ierr
      type(host_t), pointer :: host
      logical, allocatable :: active(:)
      logical :: is_done
      type(error_t), allocatable :: error

      idone = 0
      istat = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMUPD", error, n=n, m=m, k=k)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      active = iact /= 0
      if (any(abs(amag) > 0.0_c_double)) then
         call interface_update_active(host%face, real(u0, wp), real(du, wp), real(alam, wp), &
            active, is_done, istat, error, real(amag, wp))
      else
         call interface_update_active(host%face, real(u0, wp), real(du, wp), real(alam, wp), &
            active, is_done, istat, error)
      end if
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      iact = merge(1, 0, active)
      idone = merge(1, 0, is_done)
   end subroutine emupd

   !> Leave the NRED contacts at the places IRED of the selected set out for the rest of the step.
   subroutine emdrop(ih, nred, ired, m, iact, ierr) bind(c, name="emdrop_")
      integer(c_int), intent(in) :: ih(handle_size), nred, ired(nred), m
      integer(c_int), intent(out) :: iact(m), ierr
      type(host_t), pointer :: host
      logical, allocatable :: active(:)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMDROP", error, m=m)
      if (.not. allocated(error)) then
         allocate(active(max(0, host_contacts(host))))
         call interface_drop(host%face, ired, active, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) iact = merge(1, 0, active)
   end subroutine emdrop

   !> P and DF, one pattern of NU rows over NU - K columns, for the contacts of the last EMEVAL.
   !> NRED > 0: the contacts at the places IRED(K) follow from others, and there are no matrices.
   subroutine emnull(ih, nu, k, maxnz, nz, irow, icol, p, df, nred, ired, ierr) &
      bind(c, name="emnull_")
      integer(c_int), intent(in) :: ih(handle_size), nu, k, maxnz
      integer(c_int), intent(out) :: nz, irow(nu + 1_c_int64_t), icol(maxnz)
      real(c_double), intent(out) :: p(maxnz), df(maxnz)
      integer(c_int), intent(out) :: nred, ired(k), ierr
      type(host_t), pointer :: host
      type(csr_t) :: force, gap
      integer, allocatable :: redundant(:)
      type(error_t), allocatable :: error

      nz = 0
      nred = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call host_fit("EMNULL: NU", nu, host%face%n_unknown, error)
      call host_fit("EMNULL: K", k, host%face%active%set%n, error)
      if (.not. allocated(error)) call interface_null_space(host%face, force, gap, redundant, error)
      if (.not. allocated(error)) then
         irow = 1
         ired = 0
         nred = size(redundant)
         ired(:nred) = redundant
         if (nred == 0) call host_index(force, irow, icol, nz, error)
      end if
      call host_pass(host, error, ierr)
      if (allocated(error) .or. nred > 0) return
      p(:nz) = real(force%value(:nz), c_double)
      df(:nz) = real(gap%value(:nz), c_double)
   end subroutine emnull

   !> ALAM(K) from the residual R(NU) = T^T r without contact, after EMNULL.
   subroutine emlam(ih, nu, r, k, alam, ierr) bind(c, name="emlam_")
      integer(c_int), intent(in) :: ih(handle_size), nu
      real(c_double), intent(in) :: r(nu)
      integer(c_int), intent(in) :: k
      real(c_double), intent(out) :: alam(k)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      real(wp), allocatable :: lam(:)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMLAM", error, k=k, nu=nu)
      if (.not. allocated(error)) then
         allocate(lam(max(0, host_selected(host))))
         call interface_multipliers(host%face, real(r, wp), lam, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) alam = real(lam, c_double)
   end subroutine emlam

   !> DW(NU): the motion of dependent unknowns that closes DEFECT(K), after EMNULL.
   subroutine empart(ih, k, defect, nu, dw, ierr) bind(c, name="empart_")
      integer(c_int), intent(in) :: ih(handle_size), k
      real(c_double), intent(in) :: defect(k)
      integer(c_int), intent(in) :: nu
      real(c_double), intent(out) :: dw(nu)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      real(wp), allocatable :: part(:)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call fit(host, "EMPART", error, k=k, nu=nu)
      if (.not. allocated(error)) then
         allocate(part(max(0, host_unknowns(host))))
         call interface_particular(host%face, real(defect, wp), part, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) dw = real(part, c_double)
   end subroutine empart

   !> An error for the first count that is not what the interface has, before arrays are touched.
   subroutine fit(host, place, error, n, m, k, nu)
      type(host_t), intent(in) :: host
      character(len=*), intent(in) :: place      !! the subroutine
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int), intent(in), optional :: n, m         !! nodes, possible contacts
      integer(c_int), intent(in), optional :: k, nu        !! selected contacts, unknowns

      if (present(n)) call host_fit(place // ": N", n, host%face%n_node, error)
      if (present(m)) call host_fit(place // ": M", m, host_contacts(host), error)
      if (present(k)) call host_fit(place // ": K", k, host_selected(host), error)
      if (present(nu)) call host_fit(place // ": NU", nu, host_unknowns(host), error)
   end subroutine fit

end module emcon_legacy_step
