!> Whether what is given to a model fits it.
module emcon_host_check
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host, only : host_copy_solvers, host_count, host_find_solver, host_t, n_counted
   use emcon_host_force, only : host_force_t
   use emcon_kinds, only : dp, wp
   use emcon_scene, only : scene_t, where_text
   use emcon_solver_registry, only : solver_user, solver_names
   use emcon_sparse_solver, only : solver_box_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_check_force, host_check_mass, host_check_matrix, host_check_scene, host_name

   !> Entries of an assembled mass are rounded by less than this part of what they are sums of.
   real(dp), parameter :: noise = 64.0_dp*epsilon(1.0_dp)

contains

   !> "the given force NAME"
   pure function host_name(force) result(text)
      class(host_force_t), intent(in) :: force
      character(len=host_length(force)) :: text

      text = "the given force"
      if (allocated(force%name)) text = "the given force " // force%name
   end function host_name

   pure integer function host_length(force)
      class(host_force_t), intent(in) :: force

      host_length = len("the given force")
      if (allocated(force%name)) host_length = host_length + 1 + len(force%name)
   end function host_length

   !> The pattern of `force` is one over the freedoms of the nodes.
   subroutine host_check_force(force, n_dim, n_node, error)
      class(host_force_t), intent(in) :: force
      integer, intent(in) :: n_dim, n_node       !! of the model
      type(error_t), allocatable, intent(out) :: error

      call host_check_matrix(force%pattern, n_dim*n_node, n_dim*n_node, host_name(force) // &
         ": its pattern", to_text(n_dim) // " freedoms for each of " // to_text(n_node) // &
         " nodes", error)
   end subroutine host_check_force

   !> `mass` is a matrix between `n_node` nodes that can be one: finite, symmetric, not negative.
   subroutine host_check_mass(mass, scene, error)
      type(csr_t), intent(in) :: mass
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j, k

      call host_check_matrix(mass, size(scene%x, 2), size(scene%x, 2), "the given mass", &
         to_text(size(scene%x, 2)) // " nodes", error)
      if (allocated(error)) return
      if (.not. allocated(mass%value)) then
         call raise(error, err_input, "the given mass has no values")
      else if (size(mass%value) /= size(mass%column)) then
         call raise(error, err_input, "the given mass has " // to_text(size(mass%value)) // &
            " values for " // to_text(size(mass%column)) // " places")
      end if
      if (allocated(error)) return
      do i = 1, mass%n_row
         do k = mass%row_start(i) + 1, mass%row_start(i + 1)
            j = mass%column(k) + 1
            if (.not. ieee_is_finite(mass%value(k))) then
               call refuse("is not finite")
            else if (i == j .and. mass%value(k) < 0.0_dp) then
               call refuse("is negative: " // to_text(real(mass%value(k), wp)))
            else if (i /= j .and. abs(mass%value(k)) > bound(i, j)) then
               call refuse("is larger than those between each node and itself allow: " // &
                  to_text(real(mass%value(k), wp)))
            else if (abs(mass%value(k) - entry(j, i)) > noise*bound(i, j)) then
               call refuse("is not that of the other way round: " // &
                  to_text(real(mass%value(k), wp)) // ", " // to_text(real(entry(j, i), wp)))
            end if
            if (allocated(error)) return
         end do
      end do

   contains

      pure real(dp) function entry(i, j)
         integer, intent(in) :: i, j
         integer :: k

         entry = 0.0_dp
         k = csr_find(mass, i, j)
         if (k > 0) entry = mass%value(k)
      end function entry

      !> A matrix that is not negative has m_ij^2 <= m_ii m_jj.
      pure real(dp) function bound(i, j)
         integer, intent(in) :: i, j

         bound = (1.0_dp + noise)*sqrt(max(0.0_dp, entry(i, i)))*sqrt(max(0.0_dp, entry(j, j)))
      end function bound

      subroutine refuse(text)
         character(len=*), intent(in) :: text

         call raise(error, err_input, "the given mass between nodes " // &
            to_text(scene%node%label(i)) // " and " // to_text(scene%node%label(j)) // " " // text)
      end subroutine refuse

   end subroutine host_check_mass

   !> A matrix of `n` by `n_column` in the form that `csr_t` promises.
   subroutine host_check_matrix(pattern, n, n_column, title, extent, error)
      type(csr_t), intent(in) :: pattern                 !! values are not looked at
      integer, intent(in) :: n, n_column                 !! rows and columns that it is to have
      character(len=*), intent(in) :: title              !! what it is, for messages
      character(len=*), intent(in) :: extent             !! and what its rows and columns are of
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k

      if (pattern%n_row /= n .or. pattern%n_col /= n_column) then
         call raise(error, err_input, title // " has " // to_text(pattern%n_row) // " rows and " &
            // to_text(pattern%n_col) // " columns, not those of " // extent)
      else if (.not. (allocated(pattern%row_start) .and. allocated(pattern%column))) then
         call raise(error, err_input, title // " has no rows")
      else if (size(pattern%row_start) /= n + 1) then
         call raise(error, err_input, title // " has " // to_text(size(pattern%row_start)) // &
            " row starts, not " // to_text(n + 1))
      else if (pattern%row_start(1) /= 0 .or. pattern%row_start(n + 1) /= size(pattern%column)) &
         then
         call raise(error, err_input, title // ": its row starts run from " // &
            to_text(pattern%row_start(1)) // " to " // to_text(pattern%row_start(n + 1)) // &
            ", not from 0 to " // to_text(size(pattern%column)))
      end if
      if (allocated(error)) return
      do i = 1, n
         if (pattern%row_start(i + 1) < pattern%row_start(i)) then
            call raise(error, err_input, title // ": row " // to_text(i) // &
               " ends before it begins")
            return
         end if
      end do
      do i = 1, n
         do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
            if (pattern%column(k) >= 0 .and. pattern%column(k) < n_column) then
               if (k == pattern%row_start(i) + 1) cycle
               if (pattern%column(k) > pattern%column(k - 1)) cycle
            end if
            call raise(error, err_input, title // ": column " // to_text(pattern%column(k)) // &
               " in row " // to_text(i) // " is not in 0.." // to_text(n_column - 1) // &
               " or not above the one before it")
            return
         end do
      end do
   end subroutine host_check_matrix

   !> There is something to compute, each node that the deck says is given has forces or mass, and
   !> solvers that it names are there.
   subroutine host_check_scene(host, scene, error)
      type(host_t), intent(in) :: host
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: i, n, counts(n_counted)

      call check_solvers(host, scene, error)
      if (allocated(error)) return
      counts = host_count(host)
      if (all(counts(:2) == 0)) then
         if (allocated(scene%host%node)) then
            call raise(error, err_input, where_text(scene, scene%host%origin) // ": error: " // &
               "*GIVEN FORCES: no forces were given; they come from a program that calls the " // &
               "library, see docs/embedding.md")
         else if (size(scene%element%kind) == 0) then
            call raise(error, err_input, "there are no elements, and no forces were given")
         end if
      end if
      if (allocated(error) .or. .not. allocated(scene%host%node)) return
      do i = 1, size(scene%host%node)
         n = scene%host%node(i)
         if (has_row(host%mass, n)) cycle
         if (has_force(n)) cycle
         call raise(error, err_input, where_text(scene, scene%host%origin) // ": error: *GIVEN " &
            // "FORCES names node " // to_text(scene%node%label(n)) // &
            ", which has neither forces nor mass in what was given")
         return
      end do

   contains

      pure logical function has_force(node)
         integer, intent(in) :: node
         integer :: k, a

         has_force = .false.
         if (.not. allocated(host%force)) return
         do k = 1, size(host%force)
            associate (pattern => host%force(k)%force%pattern)
               do a = 1, scene%n_dim
                  has_force = has_force .or. has_row(pattern, scene%n_dim*(node - 1) + a)
               end do
            end associate
         end do
      end function has_force

   end subroutine host_check_scene

   !> Each solver that a step names and that is not of EMCON was given.
   subroutine check_solvers(host, scene, error)
      type(host_t), intent(in) :: host
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(solver_box_t), allocatable :: solver(:)
      character(len=:), allocatable :: known
      integer :: i

      call host_copy_solvers(host, solver)
      do i = 1, size(scene%step)
         associate (step => scene%step(i))
            if (step%solution%solver /= solver_user) cycle
            if (host_find_solver(solver, step%solution%solver_name) > 0) cycle
            call solver_names(known)
            call raise(error, err_input, where_text(scene, step%solution%solver_origin) &
               // ": error: " // &
               "SOLVER=" // step%solution%solver_name &
               // ": no program has given this solver, see " // &
               "docs/embedding.md; those of EMCON are " // known)
            return
         end associate
      end do
   end subroutine check_solvers

   pure logical function has_row(matrix, i)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: i

      has_row = i <= matrix%n_row
      if (has_row) has_row = matrix%row_start(i + 1) > matrix%row_start(i)
   end function has_row

end module emcon_host_check
