!> Forces that a model was given, as a term: which freedoms they connect, their place in the matrix,
!> what they answer.
!>
!> Source: docs/theory.md, section 11.
module emcon_host_term
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_find, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_host_check, only : host_check_force, host_name
   use emcon_host_force, only : force_response_t, host_failed, host_force_t, host_ok, &
      host_outside
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_reduction, only : freedom_numbers, reduction_slot
   use emcon_scene, only : scene_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_term, only : fastest_t, response_t, term_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_term_t, host_term_init

   type, extends(term_t) :: host_term_t
      class(host_force_t), allocatable :: force
      type(force_response_t) :: answer           !! the last one
      integer, allocatable, private :: slot(:)   !! of the pattern, as `reduction_slot`
      integer, allocatable, private :: label(:)  !! (n_node)
      real(wp), allocatable, private :: position(:, :)   !! (n_dim, n_node) sizes of positions [L]
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
      procedure :: find_fastest
      procedure :: is_symmetric
   end type host_term_t

contains

   !> Take over a copy of `force`, if it fits `scene`.
   subroutine host_term_init(self, force, scene, error)
      type(host_term_t), intent(out) :: self
      class(host_force_t), intent(in) :: force
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k, n, n_dim

      n_dim = size(scene%x, 1)
      n = size(scene%x, 2)
      call host_check_force(force, n_dim, n, error)
      if (allocated(error)) return
      allocate(self%force, source=force)
      call self%force%place(scene%x)
      self%label = scene%node%label
      allocate(self%may_hold(n), source=.false.)
      associate (pattern => self%force%pattern)
         do i = 1, pattern%n_row
            do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
               self%may_hold([(i - 1)/n_dim, pattern%column(k)/n_dim] + 1) = .true.
            end do
         end do
         allocate(self%slot(size(pattern%column)), source=0)
         allocate(self%answer%tangent(size(pattern%column)), source=0.0_dp)
      end associate
      allocate(self%answer%force, self%answer%magnitude, self%position, source=0.0_wp*scene%x)
   end subroutine host_term_init

   !> The freedoms of the pattern, two by two.
   pure subroutine lay_out(self, lists)
      class(host_term_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer, allocatable :: length(:), freedom(:)
      integer :: i, j, k, m, n

      associate (pattern => self%force%pattern)
         allocate(length(size(pattern%column)), freedom(2*size(pattern%column)))
         m = 0
         n = 0
         do i = 1, pattern%n_row
            do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
               j = pattern%column(k) + 1
               if (j < i) then
                  if (csr_find(pattern, j, i) > 0) cycle
               end if
               m = m + 1
               length(m) = merge(1, 2, j == i)
               freedom(n + 1) = i
               freedom(n + length(m)) = j
               n = n + length(m)
            end do
         end do
      end associate
      call lists_append(lists, length(:m), freedom(:n))
   end subroutine lay_out

   !> Find the places of the tangent in the matrix.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(host_term_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! not used: the pattern need not be symmetric
      integer, allocatable :: number(:)
      integer :: i, k

      allocate(number, source=freedom_numbers(space%numbering))
      associate (pattern => self%force%pattern)
         do i = 1, pattern%n_row
            do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
               self%slot(k) = reduction_slot(space%reduction, matrix, number(i), &
                  number(pattern%column(k) + 1))
            end do
         end do
      end associate
   end subroutine begin_step

   !> Forces of a motion, or why there are none.
   subroutine respond(self, motion, response, value, side)
      class(host_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: k

      call ask(self, motion, present(value))
      call judge(self, response)
      if (allocated(response%refusal) .or. allocated(response%failure)) return
      associate (total => response%part(self%role))
         total%force = total%force + self%answer%force
         if (response%with_sizes) then
            self%position = abs(motion%x) + max(abs(motion%u0), abs(motion%u0 + motion%du))
            call complete_magnitude(self%force%pattern, self%answer%force, self%answer%magnitude)
            call add_rounding(self%force%pattern, self%answer%tangent, self%position, &
               response%rounding)
            total%magnitude = total%magnitude + self%answer%magnitude
         end if
      end associate
      response%potential = response%potential + self%answer%energy
      if (.not. present(value)) return
      do k = 1, size(self%slot)
         associate (slot => self%slot(k))
            if (slot > 0) value(slot) = value(slot) + self%answer%tangent(k)
            if (slot < 0) side(-slot) = side(-slot) + self%answer%tangent(k)
         end associate
      end do
   end subroutine respond

   !> The answer of the force to a motion; its tangent is the last one asked for.
   subroutine ask(self, motion, wants_tangent)
      class(host_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed
      logical, intent(in) :: wants_tangent

      self%answer%force = 0.0_wp
      self%answer%magnitude = 0.0_wp
      self%answer%energy = 0.0_wp
      self%answer%status = host_ok
      if (wants_tangent) self%answer%tangent = 0.0_dp
      call self%force%respond(motion%from, motion%by, wants_tangent, self%answer)
      if (wants_tangent) self%answer%tangent = real(motion%weight, dp)*self%answer%tangent
   end subroutine ask

   !> Turn what the force reports, or what is not finite, into a refusal or a failure.
   subroutine judge(self, response)
      type(host_term_t), intent(in) :: self
      type(response_t), intent(inout) :: response
      character(len=:), allocatable :: name
      integer :: k

      name = host_name(self%force)
      associate (answer => self%answer)
         select case (answer%status)
         case (host_ok)
            if (ieee_is_finite(answer%energy) .and. all(ieee_is_finite(answer%force)) &
               .and. all(ieee_is_finite(answer%tangent))) return
            do k = 1, size(answer%force, 2)
               if (all(ieee_is_finite(answer%force(:, k)))) cycle
               response%refusal = name // " is made infinite or NaN at node " // &
                  to_text(self%label(k))
               return
            end do
            if (ieee_is_finite(answer%energy)) name = "tangent of " // name
            if (.not. ieee_is_finite(answer%energy)) name = "energy of " // name
            response%refusal = "the " // name // " is made infinite or NaN"
         case (host_outside)
            response%refusal = name // " is put out of its range"
         case (host_failed)
            name = name // " failed"
            if (allocated(self%force%reason)) name = name // ": " // self%force%reason
            call raise(response%failure, err_analysis, name)
         case default
            call raise(response%failure, err_input, name // " returned the status " // &
               to_text(answer%status) // ", which is none")
         end select
      end associate
   end subroutine judge

   !> Where no contributions are told: they are no smaller than the forces, and no smaller than the
   !> forces at the freedoms that depend on them. Inside a body in equilibrium forces cancel, but
   !> not where it is held: there is a size to relate a residual to also without any load.
   pure subroutine complete_magnitude(pattern, force, magnitude)
      type(csr_t), intent(in) :: pattern
      real(wp), intent(in) :: force(:, :)                !! (n_dim, n_node)
      real(wp), intent(inout) :: magnitude(:, :)         !! (n_dim, n_node)
      integer :: a, i, k, n_dim

      if (any(magnitude > 0.0_wp)) then
         magnitude = max(magnitude, abs(force))
         return
      end if
      magnitude = abs(force)
      n_dim = size(force, 1)
      do i = 1, size(force, 2)
         do a = 1, n_dim
            associate (row => n_dim*(i - 1) + a)
               do k = pattern%row_start(row) + 1, pattern%row_start(row + 1)
                  magnitude(a, i) = max(magnitude(a, i), abs(value_at(force, pattern%column(k))))
               end do
            end associate
         end do
      end do
   end subroutine complete_magnitude

   !> Positions are rounded by epsilon of their size, whatever a giver computes from them.
   pure subroutine add_rounding(pattern, tangent, position, rounding)
      type(csr_t), intent(in) :: pattern
      real(dp), intent(in) :: tangent(:)
      real(wp), intent(in) :: position(:, :)             !! (n_dim, n_node)
      real(wp), intent(inout) :: rounding(:, :)          !! (n_dim, n_node)
      integer :: a, i, k, n_dim

      n_dim = size(position, 1)
      do i = 1, size(position, 2)
         do a = 1, n_dim
            associate (row => n_dim*(i - 1) + a)
               do k = pattern%row_start(row) + 1, pattern%row_start(row + 1)
                  rounding(a, i) = rounding(a, i) &
                     + abs(real(tangent(k), wp))*value_at(position, pattern%column(k))
               end do
            end associate
         end do
      end do
   end subroutine add_rounding

   !> Entry `column`, from 0, of a nodal field.
   pure real(wp) function value_at(field, column)
      real(wp), intent(in) :: field(:, :)                !! (n_dim, n_node)
      integer, intent(in) :: column

      associate (n_dim => size(field, 1))
         value_at = field(1 + mod(column, n_dim), column/n_dim + 1)
      end associate
   end function value_at

   !> Add the tangent of a motion times `direction` to `product`, where there is one.
   subroutine tangent_times(self, motion, direction, product)
      class(host_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]
      type(response_t) :: verdict
      integer :: i, k, n_dim

      n_dim = size(direction, 1)
      call ask(self, motion, .true.)
      call judge(self, verdict)
      if (allocated(verdict%refusal) .or. allocated(verdict%failure)) return
      associate (pattern => self%force%pattern)
         do i = 1, pattern%n_row
            associate (to => product(1 + mod(i - 1, n_dim), (i - 1)/n_dim + 1))
               do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
                  to = to + real(self%answer%tangent(k), wp)*value_at(direction, pattern%column(k))
               end do
            end associate
         end do
      end associate
   end subroutine tangent_times

   !> As the giver says.
   pure logical function is_symmetric(self, motion)
      class(host_term_t), intent(in) :: self
      type(motion_t), intent(in) :: motion       !! placed

      if (motion%evaluation%is_gradient) then
         is_symmetric = self%force%is_symmetric_at_end
      else
         is_symmetric = self%force%is_symmetric_in_steps
      end if
   end function is_symmetric

   !> What is given has a stiffness that no element bounds.
   subroutine find_fastest(self, motion, fastest, is_bounded)
      class(host_term_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion       !! placed at its end
      type(fastest_t), intent(inout) :: fastest
      logical, intent(inout) :: is_bounded       !! by elements

      is_bounded = .false.
   end subroutine find_fastest

end module emcon_host_term
