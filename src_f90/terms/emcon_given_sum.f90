!> What a model was given, joined: freedoms that it connects, its place in the matrix, its sum.
!>
!> Source: docs/theory.md, section 12.
module emcon_given_sum
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_csr, only : csr_find, csr_from_entries, csr_t
   use emcon_errors, only : err_analysis, err_input, error_t, raise
   use emcon_given, only : given_copy_forces, given_t
   use emcon_given_check, only : given_check_force, given_check_mass, given_name
   use emcon_given_force, only : given_failed, given_ok, given_outside
   use emcon_kinds, only : dp, wp
   use emcon_motion, only : motion_t
   use emcon_reduction, only : reduction_slot, reduction_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: given_sum_t, given_sum_init, given_sum_links, given_sum_append, given_sum_place, &
      given_sum_respond, given_sum_add_tangent, given_sum_tangent_times, given_sum_is_symmetric, &
      given_sum_massless

   type :: given_sum_t
      logical :: is_any = .false.                !! anything was given
      type(given_t) :: given
      !> Which freedoms meet, in patterns or in the mass; structurally symmetric.
      type(csr_t) :: joined
      logical, allocatable :: has_force(:)       !! (n_node) in the pattern of a force
      integer, allocatable :: first(:)           !! (n_force + 1) entries before each, from 0
      integer, allocatable :: slot(:)            !! entries of all patterns, as `reduction_slot`
      real(dp), allocatable :: tangent(:)        !! the same: derivatives of the last tangent asked
      real(wp), allocatable :: force(:, :)       !! (2, n_node) sum over all
      real(wp), allocatable :: magnitude(:, :)   !! (2, n_node) sum of |contributions|
      real(wp), allocatable :: rounding(:, :)    !! (2, n_node) times epsilon: round-off
      real(wp) :: energy = 0.0_wp                !! sum over all, at the end
      integer, allocatable, private :: label(:)  !! (n_node)
      real(wp), allocatable, private :: part(:, :), part_magnitude(:, :), position(:, :)
   end type given_sum_t

contains

   !> Take over a copy of `given`, if it fits `scene`.
   subroutine given_sum_init(self, given, scene, error)
      type(given_sum_t), intent(inout) :: self
      type(given_t), intent(in) :: given
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: i, n

      call given_copy_forces(given, self%given)
      n = size(scene%x, 2)
      associate (force => self%given%force)
         self%is_any = size(force) > 0 .or. given%mass%n_row > 0
         if (.not. self%is_any) return
         allocate(self%first(size(force) + 1), source=0)
         do i = 1, size(force)
            call given_check_force(force(i)%force, n, error)
            if (allocated(error)) return
            call force(i)%force%place(scene%x)
            self%first(i + 1) = self%first(i) + size(force(i)%force%pattern%column)
         end do
         if (given%mass%n_row > 0) call given_check_mass(given%mass, scene, error)
         if (allocated(error)) return
         allocate(self%slot(self%first(size(force) + 1)), source=0)
         allocate(self%tangent(self%first(size(force) + 1)), source=0.0_dp)
      end associate
      self%label = scene%node_label
      allocate(self%has_force(n), source=.false.)
      allocate(self%force(2, n), self%magnitude(2, n), self%rounding(2, n), source=0.0_wp)
      allocate(self%part(2, n), self%part_magnitude(2, n), self%position(2, n), source=0.0_wp)
      call join(self, n)
   end subroutine given_sum_init

   !> Find `joined` and `has_force`.
   subroutine join(self, n_node)
      type(given_sum_t), intent(inout) :: self
      integer, intent(in) :: n_node
      integer, allocatable :: row(:), column(:), slot(:)
      integer :: a, i, k, l, n

      n = 2*self%first(size(self%first))
      if (self%given%mass%n_row > 0) n = n + 2*size(self%given%mass%column)
      allocate(row(n), column(n))
      n = 0
      do l = 1, size(self%given%force)
         associate (pattern => self%given%force(l)%force%pattern)
            do i = 1, pattern%n_row
               do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
                  self%has_force([(i + 1)/2, pattern%column(k)/2 + 1]) = .true.
                  call add(i, pattern%column(k) + 1)
                  call add(pattern%column(k) + 1, i)
               end do
            end do
         end associate
      end do
      associate (mass => self%given%mass)
         do i = 1, mass%n_row
            do k = mass%row_start(i) + 1, mass%row_start(i + 1)
               do a = 1, 2
                  call add(2*(i - 1) + a, 2*mass%column(k) + a)
               end do
            end do
         end do
      end associate
      call csr_from_entries(self%joined, 2*n_node, 2*n_node, row(:n), column(:n), slot)

   contains

      subroutine add(i, j)
         integer, intent(in) :: i, j

         n = n + 1
         row(n) = i
         column(n) = j
      end subroutine add

   end subroutine join

   !> Pairs of nodes whose freedoms meet; a node that meets none but itself stands with itself.
   pure subroutine given_sum_links(self, link)
      type(given_sum_t), intent(in) :: self
      integer, allocatable, intent(out) :: link(:, :)        !! (2, n)
      integer :: i, k

      allocate(link(2, size(self%joined%column)))
      do i = 1, self%joined%n_row
         do k = self%joined%row_start(i) + 1, self%joined%row_start(i + 1)
            link(:, k) = [(i + 1)/2, self%joined%column(k)/2 + 1]
         end do
      end do
   end subroutine given_sum_links

   !> Append the freedoms that meet, two by two, to the lists of elements.
   pure subroutine given_sum_append(self, start, list)
      type(given_sum_t), intent(in) :: self
      integer, allocatable, intent(inout) :: start(:), list(:)   !! for `csr_from_elements`
      integer, allocatable :: pair(:, :)
      integer :: i, k, n

      allocate(pair(2, size(self%joined%column)))
      n = 0
      do i = 1, self%joined%n_row
         do k = self%joined%row_start(i) + 1, self%joined%row_start(i + 1)
            if (self%joined%column(k) + 1 <= i) cycle
            n = n + 1
            pair(:, n) = [i, self%joined%column(k) + 1]
         end do
      end do
      k = size(list)
      list = [list, reshape(pair(:, :n), [2*n])]
      start = [start, [(k + 1 + 2*i, i = 1, n)]]
   end subroutine given_sum_append

   !> Find the places of the tangents in `matrix`.
   pure subroutine given_sum_place(self, number, reduction, matrix)
      type(given_sum_t), intent(inout) :: self
      integer, intent(in) :: number(:)           !! as `freedom_numbers` gives them
      type(reduction_t), intent(in) :: reduction
      type(csr_t), intent(in) :: matrix
      integer :: i, k, l

      do l = 1, size(self%given%force)
         associate (pattern => self%given%force(l)%force%pattern)
            do i = 1, pattern%n_row
               do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
                  self%slot(self%first(l) + k) = reduction_slot(reduction, matrix, number(i), &
                     number(pattern%column(k) + 1))
               end do
            end do
         end associate
      end do
   end subroutine given_sum_place

   !> Forces of a motion. Without `refusal` and `error` there are some.
   subroutine given_sum_respond(self, motion, wants_tangent, refusal, error)
      type(given_sum_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: wants_tangent       !! else no tangent is computed
      !> What the displacements have done to which force, for "... by the displacements"
      character(len=:), allocatable, intent(out) :: refusal
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: energy
      integer :: i, status

      self%force = 0.0_wp
      self%magnitude = 0.0_wp
      self%rounding = 0.0_wp
      self%energy = 0.0_wp
      if (wants_tangent) self%tangent = 0.0_dp
      self%position = abs(motion%x) + max(abs(motion%u0), abs(motion%u0 + motion%du))
      do i = 1, size(self%given%force)
         associate (force => self%given%force(i)%force, &
               tangent => self%tangent(self%first(i) + 1:self%first(i + 1)))
            self%part = 0.0_wp
            self%part_magnitude = 0.0_wp
            call force%respond(motion%from, motion%by, wants_tangent, self%part, &
               self%part_magnitude, energy, tangent, status)
            if (wants_tangent) tangent = real(motion%weight, dp)*tangent
            call judge(self, i, energy, tangent, status, refusal, error)
            if (allocated(refusal) .or. allocated(error)) return
            call complete_magnitude(force%pattern, self%part, self%part_magnitude)
            call add_rounding(force%pattern, tangent, self%position, self%rounding)
         end associate
         self%force = self%force + self%part
         self%magnitude = self%magnitude + self%part_magnitude
         self%energy = self%energy + energy
      end do
   end subroutine given_sum_respond

   !> Turn what force `i` reports, or what is not finite, into a refusal or an error.
   subroutine judge(self, i, energy, tangent, status, refusal, error)
      type(given_sum_t), intent(in) :: self
      integer, intent(in) :: i
      real(wp), intent(in) :: energy
      real(dp), intent(in) :: tangent(:)
      integer, intent(in) :: status
      character(len=:), allocatable, intent(inout) :: refusal
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: k

      associate (force => self%given%force(i)%force)
         select case (status)
         case (given_ok)
            if (ieee_is_finite(energy) .and. all(ieee_is_finite(self%part)) &
               .and. all(ieee_is_finite(tangent))) return
            name = given_name(force)
            do k = 1, size(self%part, 2)
               if (all(ieee_is_finite(self%part(:, k)))) cycle
               refusal = name // " is made infinite or NaN at node " // &
                  to_text(self%label(k))
               return
            end do
            if (ieee_is_finite(energy)) then
               refusal = "the tangent of " // name // " is made infinite or NaN"
            else
               refusal = "the energy of " // name // " is made infinite or NaN"
            end if
         case (given_outside)
            refusal = given_name(force) // " is put out of its range"
         case (given_failed)
            name = given_name(force) // " failed"
            if (allocated(force%reason)) name = name // ": " // force%reason
            call raise(error, err_analysis, name)
         case default
            call raise(error, err_input, given_name(force) // " returned the status " // &
               to_text(status) // ", which is none")
         end select
      end associate
   end subroutine judge

   !> Where no contributions are told: they are no smaller than the forces, and no smaller than the
   !> forces at the freedoms that depend on them. Inside a body in equilibrium forces cancel, but
   !> not where it is held: there is a size to relate a residual to also without any load.
   pure subroutine complete_magnitude(pattern, force, magnitude)
      type(csr_t), intent(in) :: pattern
      real(wp), intent(in) :: force(:, :)                !! (2, n_node)
      real(wp), intent(inout) :: magnitude(:, :)         !! (2, n_node)
      integer :: a, i, j, k

      if (any(magnitude > 0.0_wp)) then
         magnitude = max(magnitude, abs(force))
         return
      end if
      magnitude = abs(force)
      do i = 1, size(force, 2)
         do a = 1, 2
            do k = pattern%row_start(2*(i - 1) + a) + 1, pattern%row_start(2*(i - 1) + a + 1)
               j = pattern%column(k)
               magnitude(a, i) = max(magnitude(a, i), abs(force(1 + mod(j, 2), j/2 + 1)))
            end do
         end do
      end do
   end subroutine complete_magnitude

   !> Positions are rounded by epsilon of their size, whatever a giver computes from them.
   pure subroutine add_rounding(pattern, tangent, position, rounding)
      type(csr_t), intent(in) :: pattern
      real(dp), intent(in) :: tangent(:)
      real(wp), intent(in) :: position(:, :)             !! (2, n_node)
      real(wp), intent(inout) :: rounding(:, :)          !! (2, n_node)
      integer :: a, i, j, k

      do i = 1, size(position, 2)
         do a = 1, 2
            do k = pattern%row_start(2*(i - 1) + a) + 1, pattern%row_start(2*(i - 1) + a + 1)
               j = pattern%column(k)
               rounding(a, i) = rounding(a, i) &
                  + abs(real(tangent(k), wp))*position(1 + mod(j, 2), j/2 + 1)
            end do
         end do
      end do
   end subroutine add_rounding

   !> Add the tangents of the last response to the matrix and to what stands on its side.
   pure subroutine given_sum_add_tangent(self, value, side)
      type(given_sum_t), intent(in) :: self
      real(dp), intent(inout), contiguous :: value(:), side(:)   !! slots > 0, slots < 0
      integer :: k

      do k = 1, size(self%slot)
         associate (slot => self%slot(k))
            if (slot > 0) value(slot) = value(slot) + self%tangent(k)
            if (slot < 0) side(-slot) = side(-slot) + self%tangent(k)
         end associate
      end do
   end subroutine given_sum_add_tangent

   !> Add the tangents of a motion times `direction` to `product`, where there are any.
   subroutine given_sum_tangent_times(self, motion, direction, product)
      type(given_sum_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      real(wp), intent(in), contiguous :: direction(:, :)                       !! (2, n_node)
      real(wp), intent(inout), contiguous :: product(:, :)                      !! (2, n_node)
      character(len=:), allocatable :: refusal
      type(error_t), allocatable :: error
      integer :: i, j, k, l

      call given_sum_respond(self, motion, .true., refusal, error)
      if (allocated(refusal) .or. allocated(error)) return
      do l = 1, size(self%given%force)
         associate (pattern => self%given%force(l)%force%pattern)
            do i = 1, pattern%n_row
               associate (to => product(2 - mod(i, 2), (i + 1)/2))
                  do k = pattern%row_start(i) + 1, pattern%row_start(i + 1)
                     j = pattern%column(k)
                     to = to + real(self%tangent(self%first(l) + k), wp) &
                        *direction(1 + mod(j, 2), j/2 + 1)
                  end do
               end associate
            end do
         end associate
      end do
   end subroutine given_sum_tangent_times

   !> Are all tangents symmetric?
   pure logical function given_sum_is_symmetric(self, motion) result(is_symmetric)
      type(given_sum_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer :: i

      is_symmetric = .true.
      if (.not. self%is_any) return
      do i = 1, size(self%given%force)
         associate (force => self%given%force(i)%force)
            if (motion%pose%is_end) then
               is_symmetric = is_symmetric .and. force%is_symmetric_at_end
            else
               is_symmetric = is_symmetric .and. force%is_symmetric_in_steps
            end if
         end associate
      end do
   end function given_sum_is_symmetric

   !> The first node with a given force in a freedom that is an unknown, but without mass; 0: none.
   pure integer function given_sum_massless(self, unknown, mass) result(node)
      type(given_sum_t), intent(in) :: self
      integer, intent(in) :: unknown(:, :)       !! (2, n_node) > 0: is one
      type(csr_t), intent(in) :: mass            !! (n_node x n_node) of the whole model
      integer :: k

      do node = 1, mass%n_row
         if (.not. (self%has_force(node) .and. any(unknown(:, node) > 0))) cycle
         k = csr_find(mass, node, node)
         if (k == 0) return
         if (.not. mass%value(k) > 0.0_dp) return
      end do
      node = 0
   end function given_sum_massless

end module emcon_given_sum
