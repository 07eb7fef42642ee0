!> Contact with integrated gaps: what mortar and segment formulations have in common.
!>
!> One constraint per slave node A: the gap integrated over the slave edges with the multiplier
!> basis of A, as a mean over the covered part. A formulation gives the integrals of each slave
!> edge. Source: docs/theory.md, eq. (15).
module emcon_integrated_gap
   use emcon_chain_plane, only : chain_init, chain_t, chain_thickness
   use emcon_condition_nodes, only : condition_include, condition_resize_slip
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, max_penetration_on_entry, strained_only
   use emcon_contact_law, only : contact_laws_rub
   use emcon_contact_law_registry, only : contact_laws_of_surface
   use emcon_dgrad_wide, only : wide_t
   use emcon_edge_moments, only : edge_moments_t, form_constraint, form_share, gap_integral_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_seams_plane, only : chain_join
   use emcon_slip_point, only : slip_add, slip_list_t, slip_over, slip_point_t, slip_share
   implicit none
   private
   public :: integrated_gap_t, integrated_gap_init, integrated_gap_slips, integrated_gap_sagittas

   !> A slave node is let go where less than this fraction of its surface is covered: a smaller part
   !> says hardly more than the constraint of its neighbour.
   real(wp), parameter :: least_cover = 0.02_wp
   !> So far, per edge, a mean gap may be closed where contact begins: corners dip into edges.
   real(wp), parameter :: max_penetration_mean = 0.2_wp

   type, abstract, extends(contact_t) :: integrated_gap_t
      type(chain_t) :: slave
      type(chain_t), allocatable :: master            !! gfortran 12 loses a second one of its kind
      logical :: is_self = .false.                    !! a surface in contact with itself
      logical :: is_dual = .true.                     !! multiplier basis
      integer, allocatable :: node_edge(:, :)         !! (2, n_constraint) edges before and after
      real(wp), allocatable :: whole(:)               !! (n_constraint) reference length [L]
      real(wp), allocatable :: scale(:)               !! (n_constraint) covered at the start [L]
      real(wp), allocatable :: cover(:)               !! (n_constraint) covered at the end [L]
      type(edge_moments_t), allocatable :: form(:)    !! (n_edge)
      logical, allocatable :: is_formed(:)            !! (n_edge)
      logical :: leaves_second = .false.              !! of `form`: no second derivatives
      type(slip_list_t), allocatable :: slide(:)      !! (n_constraint) if it counts: of the step
      real(wp), allocatable :: own_slip(:)            !! (n_constraint) part of it at the own node
      type(wide_t) :: work(3)
   contains
      procedure :: measure_points => integrated_gap_measure
      procedure :: evaluate_points => integrated_gap_evaluate
      procedure :: area_points => integrated_gap_area
      procedure :: own_area => integrated_gap_own_area
      procedure :: share => integrated_gap_share
      procedure :: least_free => integrated_gap_least_free
      procedure :: mean_gap => integrated_gap_mean_gap
      procedure :: slip_points => integrated_gap_slip
      procedure(slip_interface), deferred :: choose_slip
      procedure(measure_interface), deferred :: measure_edges
      procedure(form_interface), deferred :: form_edge
   end type integrated_gap_t

   abstract interface

      !> What constraint `i` slides by in the step that begins, with weights of any sum > 0; of no
      !> points where it cannot act.
      pure subroutine slip_interface(self, i, x, u0, du, list)
         import :: slip_list_t, integrated_gap_t, wp
         class(integrated_gap_t), intent(in) :: self
         integer, intent(in) :: i                !! 1..n_constraint
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
         type(slip_list_t), intent(inout) :: list     !! empty
      end subroutine slip_interface

      !> Fill `form%value`: the moments of all slave edges at both ends of the step.
      pure subroutine measure_interface(self, x, u0, du)
         import :: integrated_gap_t, wp
         class(integrated_gap_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      end subroutine measure_interface

      !> Fill `form(e)` with nodes and moments in the arithmetic; `leaves_second` says which.
      pure subroutine form_interface(self, e, x, u0, du)
         import :: integrated_gap_t, wp
         class(integrated_gap_t), intent(inout) :: self
         integer, intent(in) :: e                !! slave edge
         real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      end subroutine form_interface

   end interface

contains

   !> Set up what does not depend on the formulation.
   subroutine integrated_gap_init(self, scene, pair, error)
      class(integrated_gap_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k, n

      call chain_init(self%slave, scene, scene%surface(pair%slave), error)
      if (allocated(error)) return
      if (.not. allocated(self%master)) allocate(self%master)
      call chain_init(self%master, scene, scene%surface(pair%master), error)
      if (allocated(error)) return
      call chain_join(self%slave, scene)
      call chain_join(self%master, scene)
      self%is_self = pair%slave == pair%master
      self%may_leave = .true.
      self%node = self%slave%node
      self%duplicate = self%slave%duplicate
      n = size(self%node)
      self%n_constraint = n
      self%max_penetration_at_start = max_penetration_mean
      self%offset = pair%interaction%offset
      call contact_laws_of_surface(pair%interaction, self%laws)
      self%node_edge = self%slave%node_edge
      allocate(self%state(n), self%form(self%slave%n_facet), self%slide(n))
      allocate(self%is_formed(self%slave%n_facet), source=.false.)
      call chain_thickness(self%slave, scene, self%thickness)
      allocate(self%whole(n), self%scale(n), self%cover(n), self%sagitta(n), self%own_slip(n), &
         source=0.0_wp)
      do i = 1, n
         do k = 1, 2
            associate (e => self%node_edge(k, i))
               if (e == 0) cycle
               self%whole(i) = self%whole(i) + 0.5_wp*self%slave%size(e)
            end associate
         end do
         self%state(i)%size = self%whole(i)
         if (all(self%node_edge(:, i) > 0)) cycle
         self%state(i)%size = 2.0_wp*self%whole(i)       ! the end of a chain has one edge
      end do
      self%scale = self%whole
   end subroutine integrated_gap_init

   !> Choose what the constraints slide by, for a formulation that has chosen its stencils. The
   !> weights are kept over the step, with the sum 1: docs/theory.md, eq. (14j).
   pure subroutine integrated_gap_slips(self, x, u0, du)
      class(integrated_gap_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(slip_point_t), parameter :: nothing(0) = slip_point_t()
      real(wp) :: own
      integer :: i

      if (.not. contact_laws_rub(self%laws)) return
      do i = 1, self%n_constraint
         self%slide(i)%point = nothing
         call self%choose_slip(i, x, u0, du, self%slide(i))
         associate (weight => self%slide(i)%point%weight)
            if (size(weight) > 0) weight = weight/sum(weight)
         end associate
         own = slip_share(self%slide(i)%point, self%node(i))
         self%state(i)%slip_shift = abs(own - self%own_slip(i))
         self%own_slip(i) = own
      end do
   end subroutine integrated_gap_slips

   !> Take the sagittas of the constraints from `form%value`, where the place of the gap has them:
   !> where the step begins, or where it is expected to end of what is covered there first.
   pure subroutine integrated_gap_sagittas(self)
      class(integrated_gap_t), intent(inout) :: self
      real(wp) :: rise(0:1), area(0:1), other_size
      integer :: i, k

      do i = 1, self%n_constraint
         call add_shares(self, i, rise, area, other_size)
         self%sagitta(i) = 0.0_wp
         do k = 1, 0, -1
            if (area(k) >= least_cover*self%whole(i)) self%sagitta(i) = rise(k)/area(k)
         end do
      end do
   end subroutine integrated_gap_sagittas

   !> The integral of gaps, and the area that is covered, over both edges at the node; the shortest
   !> edge of the other side there.
   pure subroutine add_shares(self, i, gap, area, size)
      class(integrated_gap_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(out) :: gap(0:1), area(0:1)   !! at start and end [L^3], [L^2]
      real(wp), intent(out) :: size              !! huge where nothing is covered [L]
      real(wp) :: part_gap(0:1), part_area(0:1)
      integer :: k

      gap = 0.0_wp
      area = 0.0_wp
      size = huge(size)
      do k = 1, 2
         if (self%node_edge(k, i) == 0) cycle
         associate (form => self%form(self%node_edge(k, i)))
            call form_share(form, 3 - k, self%is_dual, part_gap, part_area)
            size = min(size, form%other_size)
         end associate
         gap = gap + part_gap
         area = area + part_area
      end do
   end subroutine add_shares

   pure function integrated_gap_slip(self, i, x, u0, du) result(slip)
      class(integrated_gap_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: slip(size(x, 1) - 1)           !! (1) [L]
      integer :: k

      slip = 0.0_wp
      if (.not. allocated(self%slide(i)%point)) return
      do k = 1, size(self%slide(i)%point)
         slip = slip + slip_over(self%slide(i)%point(k), x, u0, du)
      end do
   end function integrated_gap_slip

   !> Mean gaps at both ends of the step; 0 where nothing is covered.
   pure subroutine integrated_gap_measure(self, x, u0, du)
      class(integrated_gap_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp) :: gap(0:1), area(0:1), least
      integer :: i

      call self%measure_edges(x, u0, du)
      do i = 1, self%n_constraint
         call add_shares(self, i, gap, area, self%state(i)%other_size)
         associate (state => self%state(i))
            ! What stores energy is followed as long as there is any to give back.
            least = least_cover*self%whole(i)
            self%scale(i) = max(area(0), least)
            if (self%step%is_penalty) least = tiny(least)
            state%is_near = maxval(area) > 0.0_wp
            state%is_covered = .true.
            state%is_over = area(1) >= least .or. (self%step%is_penalty .and. area(0) >= least)
            state%is_leaving = .not. state%is_over
            state%is_arriving = area(0) < least
            state%gap0 = 0.0_wp
            state%gap1 = 0.0_wp
            state%was_open = .true.
            if (area(0) > 0.0_wp) state%gap0 = gap(0)/area(0) - self%offset - self%sagitta(i)
            if (state%is_arriving) state%was_open = is_open(self, i)
            if (area(1) >= least) state%gap1 = gap(1)/area(1) - self%offset - self%sagitta(i)
            self%cover(i) = area(1)
         end associate
      end do
   end subroutine integrated_gap_measure

   !> Are the parts that come to be covered in the step seen from the front at its start?
   pure logical function is_open(self, i)
      class(integrated_gap_t), intent(in) :: self
      integer, intent(in) :: i
      integer :: k

      is_open = .true.
      do k = 1, 2
         if (self%node_edge(k, i) == 0) cycle
         is_open = is_open .and. self%form(self%node_edge(k, i))%ahead &
            >= -max_penetration_on_entry*self%state(i)%size
      end do
   end function is_open

   pure subroutine integrated_gap_evaluate(self, wanted, x, u0, du, target, item)
      class(integrated_gap_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)           !! (n) numbers of constraints, ascending
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      real(wp), intent(in) :: target(:)          !! (n) [L]
      type(condition_t), intent(inout) :: item(:)   !! (n)
      integer :: i, k, n

      self%is_formed = .false.
      self%leaves_second = all(item%leaves_second)
      do n = 1, size(wanted)
         i = wanted(n)
         do k = 1, 2
            associate (e => self%node_edge(k, i))
               if (e == 0) cycle
               if (self%is_formed(e)) cycle
               call self%form_edge(e, x, u0, du)
               self%is_formed(e) = .true.
            end associate
         end do
         call form_constraint(self%form, gap_integral_t(self%node(i), self%node_edge(:, i), &
            self%is_dual, target(n) + self%offset + self%sagitta(i), self%scale(i)), &
            self%work, item(n))
         item(n)%size = self%state(i)%size
         item(n)%is_mean = .true.
         if (item(n)%has_friction) call add_slip(self%slide(i)%point, x, u0, du, item(n))
      end do
   end subroutine integrated_gap_evaluate

   !> Slip and its derivatives of a condition whose gap is there.
   pure subroutine add_slip(point, x, u0, du, item)
      type(slip_point_t), intent(in) :: point(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)   !! (2, n_node) [L]
      type(condition_t), intent(inout) :: item
      integer :: k

      do k = 1, size(point)
         call condition_include(item, point(k)%node)
      end do
      call condition_resize_slip(item)
      do k = 1, size(point)
         call slip_add(point(k), x, u0, du, item)
      end do
   end subroutine add_slip

   !> The multipliers are forces by the scale of their constraints: docs/theory.md, eq. (15a).
   pure subroutine integrated_gap_area(self, x, u, area, length)
      class(integrated_gap_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)   !! (2, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]
      real(wp), intent(out) :: length(:)         !! (n_constraint) [L]

      area = self%scale*self%thickness
      length = self%cover
   end subroutine integrated_gap_area

   pure subroutine integrated_gap_own_area(self, x, area)
      class(integrated_gap_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :)    !! (2, n_node) [L]
      real(wp), intent(out) :: area(:)           !! (n_constraint) [L^2]

      area = self%whole*self%thickness
   end subroutine integrated_gap_own_area

   !> As `contact_t` has it.
   pure real(wp) function integrated_gap_least_free(self) result(least_free)
      class(integrated_gap_t), intent(in) :: self

      least_free = strained_only
   end function integrated_gap_least_free

   !> Integrals of gaps are functions of the positions alone; their means know what was covered.
   pure real(wp) function integrated_gap_share(self, i) result(share)
      class(integrated_gap_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint

      share = self%scale(i)/self%whole(i)
   end function integrated_gap_share

   pure real(wp) function integrated_gap_mean_gap(self, i, gap) result(mean_gap)
      class(integrated_gap_t), intent(in) :: self
      integer, intent(in) :: i                   !! 1..n_constraint
      real(wp), intent(in) :: gap                !! integral by what was covered at the start [L]

      mean_gap = 0.0_wp
      if (self%cover(i) > 0.0_wp) mean_gap = gap*self%scale(i)/self%cover(i)
   end function integrated_gap_mean_gap

end module emcon_integrated_gap
