!> The interface of emcon_interface for codes in the manner of Fortran 77: plain subroutines with
!> short names, default integers, double precision, no types. Calls of a step: emcon_legacy_step.
!>
!> Every subroutine begins with the handle IH(3), an integer array of the host, and ends with
!> IERR: 0 done, 2 wrong input, 3 it cannot be computed, 5 a fault of the library; EMMSG gives the
!> text. Sizes are passed and checked. Nodes, surfaces and so on count from 1, flags are 0 and 1.
!> A sparse matrix is given by rows: row I has the entries IROW(I) to IROW(I+1)-1 of ICOL and VAL;
!> MAXNZ is the room for entries and NZ the number of them, also where the room is too small.
!>
!> The names carry an underscore at the end, as compilers append it to those of external
!> subroutines: CALL EMNEW(...) finds `emnew_`.
module emcon_legacy
   use, intrinsic :: iso_c_binding, only : c_char, c_double, c_int, c_int64_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t
   use emcon_interface, only : interface_add_pair, interface_add_surface, interface_add_tie, &
      interface_follow, interface_init, interface_links, interface_prepare, interface_tie_matrices
   use emcon_interface_check, only : check_choice, check_number, refuse
   use emcon_interface_handle, only : handle_size, host_find, host_fit, host_free, host_new, &
      host_pass, host_put, host_t, no_handle
   use emcon_kinds, only : wp
   use emcon_steps, only : initiation_admissible, initiation_persistent
   use emcon_text, only : to_text
   implicit none
   private
   public :: emnew, emsurf, empair, emtie, emset, emprep, emlink, emdm, emfoll, emmsg, emfree

contains

   !> Make an interface of N nodes at X(2,N). Also where this fails there is a handle to free.
   subroutine emnew(ih, n, x, ierr) bind(c, name="emnew_")
      integer(c_int), intent(out) :: ih(handle_size)
      integer(c_int), intent(in) :: n
      real(c_double), intent(in) :: x(2, n)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call host_new(ih, host)
      call interface_init(host%face, real(x, wp), error)
      call host_pass(host, error, ierr)
   end subroutine emnew

   !> Add a surface of NE edges IED(2,NE), first and last node, the body to the left; IS becomes
   !> its number.
   subroutine emsurf(ih, ne, ied, is, ierr) bind(c, name="emsurf_")
      integer(c_int), intent(in) :: ih(handle_size), ne, ied(2, ne)
      integer(c_int), intent(out) :: is, ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      is = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call interface_add_surface(host%face, to_text(size(host%face%scene%surface) + 1), ied, is, &
         error)
      call host_pass(host, error, ierr)
   end subroutine emsurf

   !> Add a contact pair of surfaces. IFORM: 1 node to segment, 2 segment, 3 mortar. IOPT(5) and
   !> ANGLE(2), 0 for the default: integration (1 segments, 2 elements), Gauss points, multiplier
   !> (1 standard, 2 dual), normal (1 edge, 2 nodal), smoothing (1 none, 2 Hermite); feature angles
   !> of normals and of smoothing [degrees].
   subroutine empair(ih, islave, master, iform, iopt, angle, ierr) bind(c, name="empair_")
      integer(c_int), intent(in) :: ih(handle_size), islave, master, iform, iopt(5)
      real(c_double), intent(in) :: angle(2)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(contact_options_t) :: options
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      if (iopt(1) /= 0) options%integration = iopt(1)
      options%n_point = iopt(2)
      if (iopt(3) /= 0) options%multiplier = iopt(3)
      if (iopt(4) /= 0) options%normal = iopt(4)
      if (iopt(5) /= 0) options%smoothing = iopt(5)
      if (abs(angle(1)) > 0.0_c_double) options%normal_angle = real(angle(1), wp)
      if (abs(angle(2)) > 0.0_c_double) options%smoothing_angle = real(angle(2), wp)
      call interface_add_pair(host%face, islave, master, iform, options, error)
      call host_pass(host, error, ierr)
   end subroutine empair

   !> Tie two surfaces. IMULT: 1 standard, 2 dual multipliers. TOL: how far apart; < 0: a tenth of
   !> an edge.
   subroutine emtie(ih, islave, master, imult, tol, ierr) bind(c, name="emtie_")
      integer(c_int), intent(in) :: ih(handle_size), islave, master, imult
      real(c_double), intent(in) :: tol
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call interface_add_tie(host%face, islave, master, imult, real(tol, wp), error)
      call host_pass(host, error, ierr)
   end subroutine emtie

   !> Settings, also between steps. INIT: 1 holds the gap that contact begins with, which keeps
   !> energy; 2 closes it. GAPTOL: largest gap per edge at which contact may begin; 0: any.
   !> ICUT = 1: the host can repeat a step in smaller parts.
   subroutine emset(ih, init, gaptol, icut, ierr) bind(c, name="emset_")
      integer(c_int), intent(in) :: ih(handle_size), init
      real(c_double), intent(in) :: gaptol
      integer(c_int), intent(in) :: icut
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call check_choice(error, "EMSET", "INIT", init, initiation_persistent, initiation_admissible)
      call check_choice(error, "EMSET", "ICUT", icut, 0, 1)
      call check_number(error, "EMSET", "GAPTOL", real(gaptol, wp))
      if (.not. allocated(error) .and. gaptol < 0.0_c_double) call refuse(error, "EMSET", &
         "GAPTOL is negative")
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      host%face%initiation = init
      host%face%gap_tolerance = real(gaptol, wp)
      host%face%may_cut = icut == 1
   end subroutine emset

   !> Finish. IHELD(2,N) = 1 for freedoms that the host moves by itself. X(2,N) becomes the
   !> positions that fulfil the ties, DMOVE the farthest that a node has moved for that; M the
   !> number of possible contacts, NU that of the unknowns of EMLINK.
   subroutine emprep(ih, n, iheld, x, m, nu, dmove, ierr) bind(c, name="emprep_")
      integer(c_int), intent(in) :: ih(handle_size), n, iheld(2, n)
      real(c_double), intent(inout) :: x(2, n)
      integer(c_int), intent(out) :: m, nu
      real(c_double), intent(out) :: dmove
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(error_t), allocatable :: error

      m = 0
      nu = 0
      dmove = 0.0_c_double
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call host_fit("EMPREP: N", n, host%face%n_node, error)
      if (.not. allocated(error)) call interface_prepare(host%face, iheld /= 0, error)
      call host_pass(host, error, ierr)
      if (allocated(error)) return
      x = real(host%face%scene%x, c_double)
      m = host%face%n_constraint
      nu = host%face%n_unknown
      dmove = real(host%face%largest_move, c_double)
   end subroutine emprep

   !> T of u = T w, 2 N rows over NU unknowns; freedom A of node I is 2 (I - 1) + A.
   subroutine emlink(ih, n, maxnz, nz, irow, icol, val, ierr) bind(c, name="emlink_")
      integer(c_int), intent(in) :: ih(handle_size), n, maxnz
      integer(c_int), intent(out) :: nz, irow(2_c_int64_t*n + 1), icol(maxnz)
      real(c_double), intent(out) :: val(maxnz)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(csr_t) :: links
      type(error_t), allocatable :: error

      nz = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call host_fit("EMLINK: N", n, host%face%n_node, error)
      if (.not. allocated(error)) call interface_links(host%face, links, error)
      if (.not. allocated(error)) call host_put(links, irow, icol, val, nz, error)
      call host_pass(host, error, ierr)
   end subroutine emlink

   !> D (IWHICH = 1) or M (2) of tie IT over nodes. MAXROW: room for rows, NR: how many there are.
   subroutine emdm(ih, it, iwhich, maxrow, nr, maxnz, nz, irow, icol, val, ierr) &
      bind(c, name="emdm_")
      integer(c_int), intent(in) :: ih(handle_size), it, iwhich, maxrow
      integer(c_int), intent(out) :: nr
      integer(c_int), intent(in) :: maxnz
      integer(c_int), intent(out) :: nz, irow(maxrow + 1_c_int64_t), icol(maxnz)
      real(c_double), intent(out) :: val(maxnz)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      type(csr_t) :: d, m
      type(error_t), allocatable :: error

      nr = 0
      nz = 0
      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call check_choice(error, "EMDM", "IWHICH", iwhich, 1, 2)
      if (.not. allocated(error)) call interface_tie_matrices(host%face, it, d, m, error)
      if (.not. allocated(error)) then
         nr = d%n_row
         if (iwhich == 1) call host_put(d, irow, icol, val, nz, error)
         if (iwhich == 2) call host_put(m, irow, icol, val, nz, error)
      end if
      call host_pass(host, error, ierr)
   end subroutine emdm

   !> Let the tied freedoms of the displacement or velocity F(2,N) follow the others.
   subroutine emfoll(ih, n, f, ierr) bind(c, name="emfoll_")
      integer(c_int), intent(in) :: ih(handle_size), n
      real(c_double), intent(inout) :: f(2, n)
      integer(c_int), intent(out) :: ierr
      type(host_t), pointer :: host
      real(wp), allocatable :: field(:, :)
      type(error_t), allocatable :: error

      call host_find(ih, host, ierr)
      if (.not. associated(host)) return
      call host_fit("EMFOLL: N", n, host%face%n_node, error)
      if (.not. allocated(error)) then
         allocate(field, source=real(f, wp))
         call interface_follow(host%face, field, error)
      end if
      call host_pass(host, error, ierr)
      if (.not. allocated(error)) f = real(field, c_double)
   end subroutine emfoll

   !> The text of the last failure, in blanks up to the length L of TEXT.
   subroutine emmsg(ih, l, text) bind(c, name="emmsg_")
      integer(c_int), intent(in) :: ih(handle_size), l
      character(kind=c_char), intent(out) :: text(l)
      type(host_t), pointer :: host
      character(len=:), allocatable :: message
      integer(c_int) :: ierr
      integer :: i

      message = no_handle
      call host_find(ih, host, ierr)
      if (associated(host)) message = host%message
      text = " "
      do i = 1, min(l, len(message))
         text(i) = message(i:i)
      end do
   end subroutine emmsg

   !> Free an interface; its handle becomes 0. Harmless for what is no handle.
   subroutine emfree(ih) bind(c, name="emfree_")
      integer(c_int), intent(inout) :: ih(handle_size)

      call host_free(ih)
   end subroutine emfree

end module emcon_legacy
