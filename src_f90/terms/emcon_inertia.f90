! build: streams
!> Inertia s M (b du - w v0), and what the past adds: the mass between nodes, the same in all
!> directions, that of the elements and what is given.
!>
!> In explicit steps it stands at the nodes. Source: docs/theory.md, eqs. (2), (4) and section 13.
module emcon_inertia
   use emcon_csr, only : csr_find, csr_from_elements, csr_t
   use emcon_element_lists, only : element_lists
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, hp, wp
   use emcon_motion, only : motion_t
   use emcon_lumped_mass, only : lumped_mass
   use emcon_reduction, only : freedom_numbers, reduction_fold, reduction_slot
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_t
   use emcon_space, only : lists_append, lists_t, space_t
   use emcon_term, only : response_t, role_inertia, term_t
   use emcon_vectors, only : vector_add, vector_scale, vector_sum
   implicit none
   private
   public :: inertia_t, inertia_init, inertia_add, inertia_times, inertia_values, &
      inertia_mass

   !> Mass between nodes, with values in the precision of the state.
   type :: node_mass_t
      type(csr_t) :: pattern                     !! (n_node x n_node), without values
      real(wp), allocatable :: value(:)          !! as `pattern` [M]
   end type node_mass_t

   !> Where a mass between nodes stands in the matrix. Between most nodes it does as it is, with the
   !> directions of both one behind the other: one place and a stride tell all of these.
   type :: spots_t
      !> (n_node) > 0: place of direction 1 of the first entry of a row, whose nodes have all their
      !> directions one behind the other; else minus the entries of `first` before those of the row
      integer, allocatable :: row(:)
      integer, allocatable :: first(:)           !! place of direction 1; 0: in `place`
      integer, allocatable :: stride(:)          !! (n_node) to the next direction
      integer, allocatable :: place(:)           !! of all other entries
      real(dp), allocatable :: value(:)          !! as `place` [M]
   end type spots_t

   type, extends(term_t) :: inertia_t
      type(spots_t), private :: spots            !! where it is in the matrix
      integer, private :: n_entry = 0            !! of the matrix
      logical, allocatable :: is_massless(:)     !! (n_node) it has given its mass to its neighbours
      logical, allocatable :: without_density(:) !! (n_node) it has none of its own
      type(csr_t), private :: host, added        !! (n_node x n_node) beside it [M]
      type(node_mass_t), private :: consistent, lumped
      logical, private :: is_lumped = .false.    !! in the present step that is the mass
      integer, allocatable, private :: pair(:, :)   !! (n_end, any) nodes of these
      real(wp), allocatable, private :: rate(:, :), product(:, :)   !! (n_dim, n_node)
   contains
      procedure :: lay_out
      procedure :: begin_step
      procedure :: respond
      procedure :: tangent_times
   end type inertia_t

   !> Nodes between which an entry of the mass stands.
   integer, parameter :: n_end = 2
   !> Directions that the mass is multiplied in at a time.
   integer, parameter :: n_way = 2
   !> Rows that are worth more than one thread, and those that one takes at a time.
   integer, parameter :: least_shared = 2048, n_piece = 512

contains

   !> The mass of `solid` and what is given beside it.
   subroutine inertia_init(self, solid, n_dim, host, error)
      type(inertia_t), intent(out) :: self
      type(solid_t), intent(in) :: solid
      integer, intent(in) :: n_dim               !! > 0
      type(csr_t), intent(in) :: host            !! (n_node x n_node) [M]; without rows: none
      type(error_t), allocatable, intent(out) :: error

      self%role = role_inertia
      self%host = host
      allocate(self%rate(n_dim, solid%n_node), self%product(n_dim, solid%n_node), source=0.0_wp)
      call add_up(self, solid, error)
   end subroutine inertia_init

   !> Let there be the mass `added` too, in place of what was added before. The step of the deck has
   !> to begin anew.
   subroutine inertia_add(self, solid, added, error)
      type(inertia_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid         !! of `inertia_init`
      type(csr_t), intent(in) :: added           !! (n_node x n_node) [M]
      type(error_t), allocatable, intent(out) :: error

      self%added = added
      call add_up(self, solid, error)
   end subroutine inertia_add

   !> The sum of all masses.
   subroutine add_up(self, solid, error)
      type(inertia_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: start(:), list(:), slot(:), pair(:, :), added(:, :)
      real(hp), allocatable :: value(:)
      integer :: e, i, j, k, n

      call list_pairs(self%host, pair)
      call list_pairs(self%added, added)
      self%pair = reshape([pair, added], [n_end, size(pair, 2) + size(added, 2)])
      call element_lists(solid, 1, start, list)
      n = size(list)
      list = [list, reshape(self%pair, [size(self%pair)])]
      start = [start, [(n + 1 + 2*i, i = 1, size(self%pair, 2))]]
      call csr_from_elements(self%consistent%pattern, solid%n_node, start, list, slot, error)
      if (allocated(error)) return
      allocate(value(size(self%consistent%pattern%column)), source=0.0_hp)
      k = 0
      do e = 1, solid%n_element
         n = start(e + 1) - start(e)
         do j = 1, n
            do i = 1, n
               k = k + 1
               value(slot(k)) = value(slot(k)) + real(solid%mass%consistent(i, j, e), hp)
            end do
         end do
      end do
      call add_beside(self%consistent%pattern, self%host, value)
      call add_beside(self%consistent%pattern, self%added, value)
      deallocate(self%consistent%pattern%value)
      self%consistent%value = real(value, wp)
      self%is_lumped = .false.
      call lump(self, solid)
   end subroutine add_up

   !> The same mass at the nodes: that of the elements shared out, of the rest the sums of rows.
   pure subroutine lump(self, solid)
      type(inertia_t), intent(inout) :: self
      type(solid_t), intent(in) :: solid
      real(wp) :: share(size(solid%node, 1))
      real(hp) :: value(solid%n_node)
      integer :: e, i

      associate (lumped => self%lumped%pattern)
         lumped%n_row = solid%n_node
         lumped%n_col = solid%n_node
         lumped%row_start = [(i, i = 0, solid%n_node)]
         lumped%column = [(i - 1, i = 1, solid%n_node)]
         value = 0.0_hp
         do e = 1, solid%n_element
            associate (n => solid%trait%n_node(e))
               call lumped_mass(solid%mass%consistent(:n, :n, e), share(:n))
               do i = 1, n
                  associate (to => value(solid%node(i, e)))
                     to = to + real(share(i), hp)
                  end associate
               end do
            end associate
         end do
         call add_rows(value, self%host)
         call add_rows(value, self%added)
         self%lumped%value = real(value, wp)
      end associate
   end subroutine lump

   !> Add the sums of the rows of `part`.
   pure subroutine add_rows(total, part)
      real(hp), intent(inout) :: total(:)        !! (n_node)
      type(csr_t), intent(in) :: part
      integer :: i

      do i = 1, part%n_row
         total(i) = total(i) &
            + real(sum(part%value(part%row_start(i) + 1:part%row_start(i + 1))), hp)
      end do
   end subroutine add_rows

   !> Add a matrix whose pairs are in the pattern.
   pure subroutine add_beside(mass, part, value)
      type(csr_t), intent(in) :: mass            !! the pattern
      type(csr_t), intent(in) :: part
      real(hp), intent(inout) :: value(:)        !! of the pattern
      integer :: i, k

      do i = 1, part%n_row
         do k = part%row_start(i) + 1, part%row_start(i + 1)
            associate (to => value(csr_find(mass, i, part%column(k) + 1)))
               to = to + real(part%value(k), hp)
            end associate
         end do
      end do
   end subroutine add_beside

   !> The pairs of nodes between which there is mass.
   pure subroutine list_pairs(mass, pair)
      type(csr_t), intent(in) :: mass
      integer, allocatable, intent(out) :: pair(:, :)        !! (n_end, n)
      integer :: i, k

      if (mass%n_row == 0) then
         allocate(pair(n_end, 0))
         return
      end if
      allocate(pair(n_end, size(mass%column)))
      do i = 1, mass%n_row
         do k = mass%row_start(i) + 1, mass%row_start(i + 1)
            pair(:, k) = [i, mass%column(k) + 1]
         end do
      end do
   end subroutine list_pairs

   !> The freedoms that given mass connects; those of elements meet there.
   pure subroutine lay_out(self, lists)
      class(inertia_t), intent(in) :: self
      type(lists_t), intent(inout) :: lists
      integer :: freedom(n_end, lists%n_dim, size(self%pair, 2)), a

      do a = 1, lists%n_dim
         freedom(:, a, :) = lists%n_dim*(self%pair - 1) + a
      end do
      call lists_append(lists, spread(n_end, 1, size(freedom)/n_end), &
         reshape(freedom, [size(freedom)]))
   end subroutine lay_out

   !> Put the mass into the pattern of the matrix.
   subroutine begin_step(self, scene, i_step, space, matrix, slot)
      class(inertia_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: i_step              !! from 1
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: slot(:)             !! not used: mass is placed node by node
      integer, allocatable :: number(:)

      self%is_lumped = scene%step(i_step)%scheme%lumps_mass
      self%n_entry = size(matrix%column)
      allocate(number, source=freedom_numbers(space%numbering))
      if (self%is_lumped) then
         call find_spots(self%lumped, space, matrix, number, self%spots)
      else
         call find_spots(self%consistent, space, matrix, number, self%spots)
      end if
   end subroutine begin_step

   !> Where a mass stands in the matrix, and what becomes of it where unknowns are eliminated.
   subroutine find_spots(mass, space, matrix, number, spots)
      type(node_mass_t), intent(in) :: mass
      type(space_t), intent(in) :: space
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: number(:)           !! (freedoms)
      type(spots_t), intent(out) :: spots
      real(dp) :: side(size(space%reduction%side%value))
      real(dp), allocatable :: value(:)          ! in the pattern of the matrix
      integer :: i, j, k, place(size(space%is_alive, 1))

      side = 0.0_dp
      allocate(value(size(matrix%column)), source=0.0_dp)
      allocate(spots%first(size(mass%value)), spots%stride(mass%pattern%n_row), source=0)
      do i = 1, mass%pattern%n_row
         do j = mass%pattern%row_start(i) + 1, mass%pattern%row_start(i + 1)
            call find_places(i, j)
            do k = 1, size(place)
               if (place(k) > 0) value(place(k)) = value(place(k)) + real(mass%value(j), dp)
               if (place(k) < 0) side(-place(k)) = side(-place(k)) + real(mass%value(j), dp)
            end do
         end do
      end do
      call reduction_fold(space%reduction, matrix, value, side)
      do i = 1, mass%pattern%n_row
         do j = mass%pattern%row_start(i) + 1, mass%pattern%row_start(i + 1)
            call find_places(i, j)
            if (.not. stands_alone(real(mass%value(j), dp))) cycle
            spots%first(j) = place(1)
            value(place) = 0.0_dp          ! what is left has places of its own
         end do
      end do
      call shorten_rows(size(place), mass%pattern, spots)
      call list_others(value, spots)

   contains

      !> Of entry `j` of the mass, in row `i`, in all directions.
      subroutine find_places(i, j)
         integer, intent(in) :: i, j

         associate (n => size(place))
            place = [(reduction_slot(space%reduction, matrix, number(n*(i - 1) + k), &
               number(n*mass%pattern%column(j) + k)), k = 1, n)]
         end associate
      end subroutine find_places

      !> Is a mass all that is at its places, which have the stride of the row?
      logical function stands_alone(own)
         real(dp), intent(in) :: own
         integer :: a

         stands_alone = .false.
         if (any(place <= 0) .or. .not. abs(own) > 0.0_dp) return
         if (spots%stride(i) == 0) spots%stride(i) = place(size(place)) &
            - place(size(place) - 1)
         stands_alone = all([(place(a) - place(a - 1) == spots%stride(i), a = 2, size(place))]) &
            .and. .not. any(abs(value(place) - own) > 0.0_dp)
      end function stands_alone

   end subroutine find_spots

   !> Where places follow from the first one of a row, only that is kept.
   pure subroutine shorten_rows(n_dim, pattern, spots)
      integer, intent(in) :: n_dim
      type(csr_t), intent(in) :: pattern
      type(spots_t), intent(inout) :: spots      !! `first` has the places of all entries
      integer :: i, k, m, n

      allocate(spots%row(pattern%n_row), source=0)
      n = 0
      do i = 1, pattern%n_row
         associate (before => pattern%row_start(i))
            m = pattern%row_start(i + 1) - before
            spots%row(i) = -n
            if (m > 0) then
               if (spots%first(before + 1) > 0 .and. all(spots%first(before + 1:before + m) &
                  == spots%first(before + 1) + n_dim*[(k, k = 0, m - 1)])) then
                  spots%row(i) = spots%first(before + 1)
                  cycle
               end if
            end if
            spots%first(n + 1:n + m) = spots%first(before + 1:before + m)
            n = n + m
         end associate
      end do
      spots%first = spots%first(:n)
   end subroutine shorten_rows

   !> The place of direction 1 of entry `k` of row `i`; 0: there is none.
   pure integer function spot_of(n_dim, spots, i, k) result(place)
      integer, intent(in) :: n_dim
      type(spots_t), intent(in) :: spots
      integer, intent(in) :: i, k                !! from 1

      if (spots%row(i) > 0) then
         place = spots%row(i) + n_dim*(k - 1)
      else
         place = spots%first(k - spots%row(i))
      end if
   end function spot_of

   !> List the places that have a value. No arrays of all places: the matrix is laid out meanwhile,
   !> and nothing later takes as much memory.
   pure subroutine list_others(value, spots)
      real(dp), intent(in), contiguous :: value(:)       !! in the pattern of the matrix [M]
      type(spots_t), intent(inout) :: spots
      integer :: k, n

      n = count(abs(value) > 0.0_dp)
      allocate(spots%place(n), spots%value(n))
      n = 0
      do k = 1, size(value)
         if (.not. abs(value(k)) > 0.0_dp) cycle
         n = n + 1
         spots%place(n) = k
         spots%value(n) = value(k)
      end do
   end subroutine list_others

   !> Add a factor times the mass to the values of the matrix.
   pure subroutine add_mass(n_dim, mass, spots, factor, value)
      integer, intent(in) :: n_dim
      type(node_mass_t), intent(in) :: mass
      type(spots_t), intent(in) :: spots
      real(dp), intent(in) :: factor
      real(dp), intent(inout), contiguous :: value(:)
      integer :: a, i, k, place

      do i = 1, mass%pattern%n_row
         do k = mass%pattern%row_start(i) + 1, mass%pattern%row_start(i + 1)
            place = spot_of(n_dim, spots, i, k - mass%pattern%row_start(i))
            if (place == 0) cycle
            do a = 1, n_dim
               value(place) = value(place) + factor*real(mass%value(k), dp)
               place = place + spots%stride(i)
            end do
         end do
      end do
      do k = 1, size(spots%place)
         value(spots%place(k)) = value(spots%place(k)) + factor*spots%value(k)
      end do
   end subroutine add_mass

   !> The mass between nodes, as it is in the present step.
   pure subroutine inertia_mass(self, mass)
      class(inertia_t), intent(in) :: self
      type(csr_t), intent(out) :: mass           !! (n_node x n_node) [M]

      if (self%is_lumped) then
         mass = self%lumped%pattern
         mass%value = real(self%lumped%value, dp)
      else
         mass = self%consistent%pattern
         mass%value = real(self%consistent%value, dp)
      end if
   end subroutine inertia_mass

   !> The mass in the pattern of the matrix.
   pure subroutine inertia_values(self, value)
      class(inertia_t), intent(in) :: self       !! in a step
      real(dp), allocatable, intent(out) :: value(:)     !! (entries of the matrix) [M]

      allocate(value(self%n_entry), source=0.0_dp)
      if (self%is_lumped) then
         call add_mass(size(self%rate, 1), self%lumped, self%spots, 1.0_dp, value)
      else
         call add_mass(size(self%rate, 1), self%consistent, self%spots, 1.0_dp, value)
      end if
   end subroutine inertia_values

   !> s M (b du - w v0), and the sizes of what it consists of; nothing where s = 0.
   subroutine respond(self, motion, response, value, side)
      class(inertia_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                     !! placed
      type(response_t), intent(inout) :: response
      real(dp), intent(inout), contiguous, optional :: value(:), side(:)   !! slots > 0, slots < 0
      real(dp) :: factor
      integer :: n

      associate (evaluation => motion%evaluation, total => response%part(self%role))
         if (.not. evaluation%mass_scale > 0.0_wp) return
         factor = real(evaluation%mass_scale*evaluation%rate, dp)
         if (present(value) .and. self%is_lumped) then
            call add_mass(size(self%rate, 1), self%lumped, self%spots, factor, value)
         else if (present(value)) then
            call add_mass(size(self%rate, 1), self%consistent, self%spots, factor, value)
         end if
         n = size(self%rate)
         call vector_sum(n, motion%du, 1.0_wp, motion%offset, self%rate)
         call vector_scale(n, evaluation%rate, self%rate)
         call vector_add(n, -evaluation%v_weight, motion%v0, self%rate)
         if (allocated(motion%dv_past)) call vector_add(n, 1.0_wp, motion%dv_past, self%rate)
         call times(self, response%n_thread)
         call vector_add(n, evaluation%mass_scale, self%product, total%force)
         if (.not. response%with_sizes) return
         self%rate = abs(evaluation%rate*(motion%du + motion%offset)) &
            + abs(evaluation%v_weight*motion%v0)
         if (allocated(motion%dv_past)) self%rate = self%rate + abs(motion%dv_past)
         call times(self, response%n_thread)
         total%magnitude = total%magnitude + evaluation%mass_scale*self%product
      end associate
   end subroutine respond

   !> Add s b M `direction` to `product`.
   subroutine tangent_times(self, motion, direction, product)
      class(inertia_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion                             !! placed
      real(wp), intent(in), contiguous :: direction(:, :)              !! (n_dim, n_node) [L]
      real(wp), intent(inout), contiguous :: product(:, :)             !! (n_dim, n_node) [M L/T^2]

      self%rate = (motion%evaluation%mass_scale*motion%evaluation%rate)*direction
      call inertia_times(self, self%rate, self%product)
      product = product + self%product
   end subroutine tangent_times

   !> `product` of `rate`.
   subroutine times(self, n_thread)
      type(inertia_t), intent(inout) :: self
      integer, intent(in) :: n_thread            !! that may work on it

      if (n_thread == 1 .or. size(self%rate, 2) < least_shared) then
         call inertia_times(self, self%rate, self%product)
      else if (self%is_lumped) then
         call share_times(self%lumped, n_thread, self%rate, self%product)
      else
         call share_times(self%consistent, n_thread, self%rate, self%product)
      end if
   end subroutine times

   !> M field, in all directions.
   pure subroutine inertia_times(self, field, product)
      class(inertia_t), intent(in) :: self
      real(wp), intent(in), contiguous :: field(:, :)        !! (n_dim, n_node)
      real(wp), intent(out), contiguous :: product(:, :)     !! (n_dim, n_node)

      if (self%is_lumped) then
         call mass_times(self%lumped, 0, size(field, 2), field, product)
      else
         call mass_times(self%consistent, 0, size(field, 2), field, product)
      end if
   end subroutine inertia_times

   !> The same by threads.
   subroutine share_times(mass, n_thread, field, product)
      type(node_mass_t), intent(in) :: mass
      integer, intent(in) :: n_thread
      real(wp), intent(in), contiguous :: field(:, :)        !! (n_dim, n_node)
      real(wp), intent(inout), contiguous :: product(:, :)   !! (n_dim, n_node)
      integer :: i

      !$omp parallel do default(none) shared(mass, field, product) num_threads(n_thread) &
      !$omp schedule(static)
      do i = 0, size(field, 2) - 1, n_piece
         call mass_times(mass, i, min(i + n_piece, size(field, 2)), field, product)
      end do
      !$omp end parallel do
   end subroutine share_times

   !> The rows behind `before` up to `last`.
   pure subroutine mass_times(mass, before, last, field, product)
      type(node_mass_t), intent(in) :: mass
      integer, intent(in) :: before, last
      real(wp), intent(in), contiguous :: field(:, :)        !! (n_dim, n_node)
      real(wp), intent(inout), contiguous :: product(:, :)   !! (n_dim, n_node)

      associate (rows => mass%pattern)
         call rows_times(size(field, 1), last - before, rows%row_start(before + 1:last + 1), &
            rows%column, mass%value, field, product(:, before + 1:last))
      end associate
   end subroutine mass_times

   !> Rows of a sparse matrix times vectors, two directions at a time: the rows are read once.
   pure subroutine rows_times(n_dim, n_row, row_start, column, value, field, product)
      integer, intent(in) :: n_dim
      integer, intent(in) :: n_row
      integer, intent(in) :: row_start(n_row + 1)            !! entries before those of each
      integer, intent(in), contiguous :: column(:)           !! from 0
      real(wp), intent(in), contiguous :: value(:)
      real(wp), intent(in) :: field(n_dim, 0:*)
      real(wp), intent(out) :: product(n_dim, n_row)         !! of these rows
      real(wp) :: first, second
      integer :: i, k, a, b

      do a = 1, n_dim, n_way
         b = min(a + n_way - 1, n_dim)
         do i = 1, n_row
            first = 0.0_wp
            second = 0.0_wp
            do k = row_start(i) + 1, row_start(i + 1)
               first = first + value(k)*field(a, column(k))
               second = second + value(k)*field(b, column(k))
            end do
            product(a, i) = first
            product(b, i) = second
         end do
      end do
   end subroutine rows_times

end module emcon_inertia
