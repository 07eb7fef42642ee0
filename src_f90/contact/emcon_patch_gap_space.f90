!> The height of a surface of triangles over a patch: its mean over a small square that moves with a
!> node, or its integral over a triangle of a slave facet, with a weight.
!>
!> The field over the frame of the patch is continuous, so its integral is smooth while the patch
!> slides over sides and corners of the triangles. Source: docs/theory.md, eqs. (43) to (49).
module emcon_patch_gap_space
   use emcon_frame_vertex_space, only : at_eta, at_height, frame_area, frame_area_t, frame_place, &
      frame_size, frame_vertex, frame_vertex_t, n_frame_var
   use emcon_kinds, only : wp
   use emcon_patch_moments_space, only : patch_area_t, patch_misses, patch_moment_slopes, &
      patch_moments, patch_products
   use emcon_polygon_clip_space, only : barycentric
   implicit none
   private
   public :: patch_t, patch_gap_t, patch_gap, patch_look_t, patch_look, &
      patch_basis_t, patch_basis, patch_open_t, patch_open, patch_gap_of

   !> Remainders below so many epsilons of what they are the difference of are round-off.
   real(wp), parameter :: rounding = 16.0_wp*epsilon(1.0_wp)
   !> A vertex whose triangles cover so much of the patch at both ends together has half its weight.
   real(wp), parameter :: some = 0.1_wp
   !> Places at which a field is given, in the coordinates of the patch.
   real(wp), parameter :: unit_corner(2, 3) = reshape([0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      1.0_wp], [2, 3])

   !> The triangles that a patch may see in a step.
   type :: patch_t
      integer :: n_vertex = 0
      integer :: n_triangle = 0
      integer, allocatable :: triangle(:, :)     !! (3, >= n_triangle) counter-clockwise
      real(wp), allocatable :: chi(:)            !! (>= n_vertex) 1; 0 where the surface ends
      real(wp) :: length = 0.0_wp                !! of the patch' sides, in the frame's vectors
      real(wp) :: unit = 1.0_wp                  !! length of these vectors, about [L]
      type(patch_area_t) :: area
      logical :: is_integral = .false.           !! of heights over its area, not by it
      logical :: of_cover = .false.              !! of 1 in the place of heights: what is covered
   end type patch_t

   !> What a patch sees at both ends of a step.
   type :: patch_look_t
      real(wp) :: height(0:1) = 0.0_wp           !! integral of chi times height, by its area [L]
      real(wp) :: cover(0:1) = 0.0_wp            !! that of chi: what is covered
      real(wp) :: way = 0.0_wp                   !! how far vertices go along it, at most [L]
      real(wp) :: ahead = 0.0_wp                 !! height at the start of what is over it at the
                                                 !! end, the least; huge: nothing is [L]
   end type patch_look_t

   !> The same of a patch of a slave facet, weight by weight.
   type :: patch_basis_t
      real(wp) :: height(3, 0:1) = 0.0_wp        !! integral of chi times height [L^3]
      real(wp) :: cover(3, 0:1) = 0.0_wp         !! that of chi [L^2]
      real(wp) :: area(0:1) = 0.0_wp             !! of all of it [L^2]
      real(wp) :: way = 0.0_wp                   !! as above
      real(wp) :: ahead = 0.0_wp                 !! as above
   end type patch_basis_t

   !> The integral of chi (height - target) over the patch by its area, over a step.
   type :: patch_gap_t
      real(wp) :: f0 = 0.0_wp, f1 = 0.0_wp       !! at both ends [L]
      real(wp) :: df = 0.0_wp                    !! how it changes, to relative accuracy [L]
      integer :: n_vertex = 0                    !! that it depends on
      integer, allocatable :: vertex(:)          !! (>= n_vertex) their numbers
      !> By both vectors of the frame, then by the vertices: discrete gradient, that at the end,
      !> and derivative of the first by variables at the end
      real(wp), allocatable :: g(:), c(:)        !! (6 + 3 n_vertex)
      real(wp), allocatable :: h(:, :)           !! the same twice; only if asked for
   end type patch_gap_t

   !> One triangle over a step.
   type :: field_t
      integer :: vertex(3) = 0                   !! among those that count
      real(wp) :: moment(3, 0:1) = 0.0_wp        !! over the part of the patch that it covers
      real(wp) :: bare(3, 0:1) = 0.0_wp          !! the same without weights
      real(wp) :: products(3, 3, 0:1) = 0.0_wp   !! of patches of facets: for each weight
      real(wp) :: value(3, 0:1) = 0.0_wp         !! its field at the `unit_corner` [L]
      real(wp) :: slope(2, 0:1) = 0.0_wp         !! of the field [L]
      real(wp) :: share(3, 3) = 0.0_wp           !! (j, v) of its corner j at v, in the mean
      real(wp) :: part(3) = 0.0_wp               !! of the integral that each corner takes
   end type field_t

   !> What the gaps of a patch over a step have in common, whatever their weights and targets are.
   type :: patch_open_t
      integer :: n_vertex = 0                    !! that they depend on
      integer, allocatable :: vertex(:)          !! (>= n_vertex) their numbers
      type(frame_vertex_t), allocatable, private :: at(:)    !! (n_vertex)
      type(field_t), allocatable, private :: field(:)
      type(frame_area_t), private :: area        !! of the frame, for an integral
   end type patch_open_t

   !> What is put on the ways of the vertices in the patch, and how it changes.
   type :: closing_t
      real(wp), allocatable :: weight(:)         !! (n_vertex) 0 to 1: as its triangles are covered
      real(wp), allocatable :: weight_slope(:)   !! (n_vertex) by what they cover of the patch
      real(wp), allocatable :: way(:, :)         !! (2, n_vertex)
      real(wp) :: factor = 0.0_wp                !! of weight times way [L]
      real(wp) :: by_rest = 0.0_wp               !! its slope by the rest,
      real(wp) :: by_square = 0.0_wp             !! and by the sum of weight times way squared
   end type closing_t

contains

   !> Where vertices are in the frame at one configuration, coordinates those of the patch.
   pure subroutine place_vertices(patch, x, place)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :)            !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(out) :: place(:, :)       !! (3, n_vertex)
      integer :: j

      do j = 1, patch%n_vertex
         place(:, j) = frame_place(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1), x(:, 3 + j) - x(:, 1))
         place(:2, j) = place(:2, j)/patch%length + patch%area%centre
      end do
   end subroutine place_vertices

   !> What a patch sees at both ends of a step.
   pure function patch_look(patch, x, dx) result(look)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      type(patch_look_t) :: look
      real(wp) :: place(3, patch%n_vertex, 0:1)

      call place_vertices(patch, x, place(:, :, 0))
      call place_vertices(patch, x + dx, place(:, :, 1))
      call find_means(patch, place(:, :, 0), look%height(0), look%cover(0))
      call find_means(patch, place(:, :, 1), look%height(1), look%cover(1))
      look%way = longest_way(patch, place)
      look%ahead = height_ahead(patch, place(:, :, 0), place(:, :, 1))
   end function patch_look

   !> What a patch of a slave facet sees at both ends of a step, with each of the weights that are 1
   !> at one of the `unit_corner` and 0 at the others.
   pure function patch_basis(patch, x, dx) result(basis)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      type(patch_basis_t) :: basis
      real(wp) :: place(3, patch%n_vertex, 0:1), products(3, 3), share(3)
      integer :: end, k, v

      do end = 0, 1
         call place_vertices(patch, x + end*dx, place(:, :, end))
         associate (size_of => frame_size(x(:, :3) + end*dx(:, :3)), height => &
               basis%height(:, end), cover => basis%cover(:, end), p => place(:, :, end))
            basis%area(end) = 0.5_wp*size_of
            do k = 1, patch%n_triangle
               associate (t => patch%triangle(:, k))
                  if (patch_misses(patch%area, p(:2, t))) cycle
                  products = size_of*patch_products(patch%area, p(:2, t))
                  do v = 1, 3
                     share = barycentric(p(:2, t), unit_corner(:, v))*patch%chi(t)
                     height = height + products(:, v)*dot_product(share, p(3, t))
                     cover = cover + products(:, v)*sum(share)
                  end do
               end associate
            end do
         end associate
      end do
      basis%way = longest_way(patch, place)
      basis%ahead = height_ahead(patch, place(:, :, 0), place(:, :, 1))
   end function patch_basis

   !> How far vertices go along a patch, at most [L].
   pure real(wp) function longest_way(patch, place) result(way)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: place(:, :, 0:)    !! (3, n_vertex, 0:1)

      way = patch%unit*patch%length*sqrt(maxval(sum((place(:2, :, 1) - place(:2, :, 0))**2, 1)))
   end function longest_way

   !> The integral of chi times height over the patch by its area, and what of it is covered.
   pure subroutine find_means(patch, place, height, cover)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: place(:, :)        !! (3, n_vertex)
      real(wp), intent(out) :: height, cover
      real(wp) :: moment(3), bare(3), share(3)
      integer :: k, v

      height = 0.0_wp
      cover = 0.0_wp
      do k = 1, patch%n_triangle
         associate (t => patch%triangle(:, k))
            if (patch_misses(patch%area, place(:2, t))) cycle
            call patch_moments(patch%area, place(:2, t), moment, bare)
            do v = 1, 3
               share = moment(v)*barycentric(place(:2, t), unit_corner(:, v))
               height = height + dot_product(share, patch%chi(t)*place(3, t))
               cover = cover + dot_product(share, patch%chi(t))
            end do
         end associate
      end do
   end subroutine find_means

   !> How high the planes of the triangles that are over the patch at the end are over it at the
   !> start: the least; huge if there are none [L].
   pure real(wp) function height_ahead(patch, from, to) result(least)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: from(:, :), to(:, :)   !! (3, n_vertex)
      integer :: k

      least = huge(least)
      do k = 1, patch%n_triangle
         associate (t => patch%triangle(:, k))
            if (patch_misses(patch%area, to(:2, t))) cycle
            if (any(patch%chi(t) <= 0.0_wp)) cycle
            least = min(least, dot_product(barycentric(from(:2, t), spread(patch%area%centre, 1, &
               2)), from(3, t)))
         end associate
      end do
   end function height_ahead

   !> The gap over a step with its derivatives. None of its vertices counts where nothing is over
   !> the patch at either end.
   pure subroutine patch_gap(patch, x, dx, target, leaves_second, gap)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! (3, 3 + n_vertex) origin, frame, vertices [L]
      real(wp), intent(in) :: target             !! that heights are counted from [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(patch_gap_t), intent(out) :: gap
      type(patch_open_t) :: open

      call patch_open(patch, x, dx, leaves_second, open)
      call patch_gap_of(patch, open, target, leaves_second, gap)
   end subroutine patch_gap

   !> What a patch is over in a step.
   pure subroutine patch_open(patch, x, dx, leaves_second, open)
      type(patch_t), intent(in) :: patch         !! whatever its weights are
      real(wp), intent(in) :: x(:, :), dx(:, :)  !! as `patch_gap`
      logical, intent(in) :: leaves_second       !! no gap with second derivatives is asked for
      type(patch_open_t), intent(out) :: open
      real(wp) :: place(3, patch%n_vertex, 0:1)
      integer :: j

      call place_vertices(patch, x, place(:, :, 0))
      call place_vertices(patch, x + dx, place(:, :, 1))
      call choose_fields(patch, place, open)
      allocate(open%at(open%n_vertex))
      do j = 1, open%n_vertex
         associate (node => [1, 2, 3, 3 + open%vertex(j)])
            call frame_vertex(x(:, node), dx(:, node), leaves_second, open%at(j))
         end associate
         call to_patch(patch, open%at(j))
      end do
      if (patch%area%n_side == 3) call frame_area(x(:, :3), dx(:, :3), leaves_second, open%area)
   end subroutine patch_open

   !> The gap of a patch.
   pure subroutine patch_gap_of(patch, open, target, leaves_second, gap)
      type(patch_t), intent(in) :: patch
      type(patch_open_t), intent(in) :: open     !! of it
      real(wp), intent(in) :: target             !! that heights are counted from [L]
      logical, intent(in) :: leaves_second       !! no second derivatives
      type(patch_gap_t), intent(out) :: gap
      type(field_t), allocatable :: field(:)
      integer :: end, k

      gap%n_vertex = open%n_vertex
      gap%vertex = open%vertex(:open%n_vertex)
      field = open%field
      if (patch%area%n_side == 3) then
         do k = 1, size(field)
            do end = 0, 1
               field(k)%moment(:, end) = matmul(patch%area%weight, field(k)%products(:, :, end))
            end do
         end do
      end if
      call add_up(patch, target, open%at, field, leaves_second, gap)
      if (patch%is_integral) call times_area(open%area, leaves_second, gap)
   end subroutine patch_gap_of

   !> Times the area of the frame, by the rule of products.
   pure subroutine times_area(area, leaves_second, gap)
      type(frame_area_t), intent(in) :: area
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(inout) :: gap
      real(wp) :: mean, mean_area
      integer, parameter :: n = 6

      mean = 0.5_wp*(gap%f0 + gap%f1)
      mean_area = 0.5_wp*(area%f(0) + area%f(1))
      if (.not. leaves_second) then
         gap%h = mean_area*gap%h
         gap%h(:, :n) = gap%h(:, :n) + 0.5_wp*outer(gap%g, area%c)
         gap%h(:n, :) = gap%h(:n, :) + 0.5_wp*outer(area%g, gap%c)
         gap%h(:n, :n) = gap%h(:n, :n) + mean*area%h
      end if
      gap%g = mean_area*gap%g
      gap%g(:n) = gap%g(:n) + mean*area%g
      gap%c = area%f(1)*gap%c
      gap%c(:n) = gap%c(:n) + gap%f1*area%c
      gap%df = mean_area*gap%df + mean*area%df
      gap%f0 = area%f(0)*gap%f0
      gap%f1 = area%f(1)*gap%f1
   end subroutine times_area

   !> Coordinates in the patch in place of those in the frame.
   pure subroutine to_patch(patch, at)
      type(patch_t), intent(in) :: patch
      type(frame_vertex_t), intent(inout) :: at

      associate (length => patch%length)
         at%f(:at_eta, :) = at%f(:at_eta, :)/length + patch%area%centre
         at%df(:at_eta) = at%df(:at_eta)/length
         at%g(:, :at_eta) = at%g(:, :at_eta)/length
         at%c(:, :at_eta) = at%c(:, :at_eta)/length
         at%h(:, :, :at_eta) = at%h(:, :, :at_eta)/length
      end associate
   end subroutine to_patch

   !> The triangles over the patch at either end, and their vertices.
   pure subroutine choose_fields(patch, place, open)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: place(:, :, 0:)    !! (3, n_vertex, 0:1)
      type(patch_open_t), intent(inout) :: open
      type(field_t) :: field
      integer :: number(patch%n_vertex), i, k, n

      allocate(open%vertex(patch%n_vertex), open%field(count_seen(patch, place)))
      number = 0
      n = 0
      do k = 1, patch%n_triangle
         associate (t => patch%triangle(:, k))
            if (is_missed(patch, place(:2, t, :))) cycle
            field = field_t()
            call find_moments(patch, place(:2, t, :), field)
            if (.not. any(abs(field%bare) > 0.0_wp)) cycle
            n = n + 1
            do i = 1, 3
               if (number(t(i)) == 0) then
                  open%n_vertex = open%n_vertex + 1
                  open%vertex(open%n_vertex) = t(i)
                  number(t(i)) = open%n_vertex
               end if
               field%vertex(i) = number(t(i))
            end do
            open%field(n) = field
         end associate
      end do
      open%field = open%field(:n)
   end subroutine choose_fields

   !> The number of triangles that may be over a patch.
   pure integer function count_seen(patch, place) result(n)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: place(:, :, 0:)
      integer :: k

      n = 0
      do k = 1, patch%n_triangle
         if (.not. is_missed(patch, place(:2, patch%triangle(:, k), :))) n = n + 1
      end do
   end function count_seen

   !> Is a triangle beside a patch at both ends?
   pure logical function is_missed(patch, corner)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: corner(2, 3, 0:1)

      is_missed = patch_misses(patch%area, corner(:, :, 0))
      if (is_missed) is_missed = patch_misses(patch%area, corner(:, :, 1))
   end function is_missed

   !> The moments of a triangle at both ends.
   pure subroutine find_moments(patch, corner, field)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: corner(2, 3, 0:1)
      type(field_t), intent(inout) :: field
      integer :: end

      do end = 0, 1
         if (patch%area%n_side == 3) then
            field%products(:, :, end) = patch_products(patch%area, corner(:, :, end))
            field%bare(:, end) = sum(field%products(:, :, end), 1)
         else
            call patch_moments(patch%area, corner(:, :, end), field%moment(:, end), &
               field%bare(:, end))
         end if
      end do
   end subroutine find_moments

   !> The sum over triangles, docs/theory.md, eqs. (46) and (47).
   pure subroutine add_up(patch, target, at, field, leaves_second, gap)
      type(patch_t), intent(in) :: patch
      real(wp), intent(in) :: target             !! [L]
      type(frame_vertex_t), intent(in) :: at(:)  !! (n_vertex)
      type(field_t), intent(inout) :: field(:)
      logical, intent(in) :: leaves_second
      type(patch_gap_t), intent(inout) :: gap
      real(wp), dimension(3, size(at)) :: by, end_by
      real(wp), dimension(size(at)) :: chi, flat !! of heights, and of 1
      real(wp) :: place(3, size(at), 0:1)
      real(wp) :: change(3*size(at), 3*size(at))
      type(closing_t) :: closing
      integer :: k

      chi = patch%chi(gap%vertex(:gap%n_vertex))
      flat = 0.0_wp
      if (patch%of_cover) then
         flat = chi
         chi = 0.0_wp
      end if
      do k = 1, size(at)
         place(:, k, :) = at(k)%f
      end do
      by = 0.0_wp
      end_by = 0.0_wp
      do k = 1, size(field)
         call form_field(chi(field(k)%vertex), flat(field(k)%vertex), target, &
            place(:, field(k)%vertex, :), field(k))
         associate (f => field(k), v => field(k)%vertex)
            gap%f0 = gap%f0 + dot_product(f%moment(:, 0), f%value(:, 0))
            gap%f1 = gap%f1 + dot_product(f%moment(:, 1), f%value(:, 1))
            by(at_height, v) = by(at_height, v) + chi(v)*f%part
            by(:at_eta, v) = by(:at_eta, v) - outer(sum(f%slope, 2)/2.0_wp, f%part)
            call add_end(chi(v), place(:at_eta, v, 1), f, end_by)
         end associate
      end do
      call close_sum(at, field, closing)
      by(:at_eta, :) = by(:at_eta, :) + closing%factor*spread(closing%weight, 1, at_eta)*closing%way
      call gather_first(at, by, end_by, gap)
      if (leaves_second) return
      call change_of_parts(patch%area, chi, place, field, change)
      call change_of_closing(patch%area, chi, place(:at_eta, :, 1), field, closing, change)
      call gather_second(at, by, change, gap)
   end subroutine add_up

   !> What the gradient lacks, put on the ways of the vertices, each by what it has to do with the
   !> patch: docs/theory.md, eq. (48).
   pure subroutine close_sum(at, field, closing)
      type(frame_vertex_t), intent(in) :: at(:)
      type(field_t), intent(in) :: field(:)
      type(closing_t), intent(out) :: closing
      real(wp) :: rest, square, size_of, ratio, area(size(at))
      integer :: j, k

      rest = 0.0_wp
      size_of = tiny(size_of)
      area = 0.0_wp
      do k = 1, size(field)
         associate (f => field(k), v => field(k)%vertex)
            rest = rest + dot_product(f%moment(:, 1) - f%moment(:, 0), sum(f%value, 2)/2.0_wp)
            size_of = max(size_of, maxval(sum(abs(f%value), 2)))
            area(v) = area(v) + sum(f%bare)
         end associate
      end do
      closing%weight = area/(area + some)
      closing%weight_slope = some/(area + some)**2
      allocate(closing%way(at_eta, size(at)))
      do j = 1, size(at)
         closing%way(:, j) = at(j)%df(:at_eta)
      end do
      ! By ways of round-off nothing is divided.
      square = rounding + sum(spread(closing%weight, 1, at_eta)*closing%way**2)
      ratio = (rest/(rounding*size_of))**2
      ratio = merge(ratio/(1.0_wp + ratio), 1.0_wp, ratio <= huge(ratio))
      closing%factor = ratio*rest/square
      closing%by_rest = ratio*(3.0_wp - 2.0_wp*ratio)/square
      closing%by_square = -closing%factor/square
   end subroutine close_sum

   !> The field of a triangle at both ends.
   pure subroutine form_field(chi, flat, target, place, field)
      real(wp), intent(in) :: chi(3), flat(3)    !! of heights, and of 1
      real(wp), intent(in) :: target             !! [L]
      real(wp), intent(in) :: place(3, 3, 0:1)   !! of its corners
      type(field_t), intent(inout) :: field
      real(wp) :: corner(2, 3, 0:1), p(3)
      integer :: v, end

      corner = place(:at_eta, :, :)
      do end = 0, 1
         p = chi*(place(at_height, :, end) - target) + flat
         do v = 1, 3
            field%value(v, end) = dot_product(p, barycentric(corner(:, :, end), unit_corner(:, v)))
         end do
         field%slope(:, end) = field%value(2:3, end) - field%value(1, end)
      end do
      do v = 1, 3
         field%share(:, v) = barycentric(sum(corner, 3)/2.0_wp, unit_corner(:, v))
      end do
      field%part = matmul(field%share, sum(field%moment, 2)/2.0_wp)
   end subroutine form_field

   !> Add the gradient at the end by places and heights.
   pure subroutine add_end(chi, corner, field, by)
      real(wp), intent(in) :: chi(3)
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      real(wp), intent(inout) :: by(:, :)        !! (3, n_vertex)
      real(wp) :: part(3)
      integer :: v

      part = 0.0_wp
      do v = 1, 3
         part = part + field%moment(v, 1)*barycentric(corner, unit_corner(:, v))
      end do
      associate (to => field%vertex)
         by(at_height, to) = by(at_height, to) + chi*part
         by(:at_eta, to) = by(:at_eta, to) - outer(field%slope(:, 1), part)
      end associate
   end subroutine add_end

   !> How what the vertices take changes with places and heights at the end.
   pure subroutine change_of_parts(patch_area, chi, place, field, change)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(:)
      real(wp), intent(in) :: place(:, :, 0:)    !! (3, n_vertex, 0:1)
      type(field_t), intent(in) :: field(:)
      real(wp), intent(out) :: change(:, :)      !! (3 n_vertex, 3 n_vertex)
      real(wp) :: part(3, 9), slope(2, 9)
      integer :: i, j, k

      change = 0.0_wp
      do k = 1, size(field)
         associate (f => field(k), v => field(k)%vertex)
            call change_of_field(patch_area, chi(v), place(:at_eta, v, :), f, part, slope)
            do i = 1, 3
               do j = 1, 3
                  associate (row => 3*(v(i) - 1), column => 3*(v(j) - 1), by => 3*(j - 1))
                     change(row + at_height, column + 1:column + 3) = &
                        change(row + at_height, column + 1:column + 3) &
                        + chi(v(i))*part(i, by + 1:by + 3)
                     change(row + 1:row + at_eta, column + 1:column + 3) = &
                        change(row + 1:row + at_eta, column + 1:column + 3) &
                        - outer(sum(f%slope, 2)/2.0_wp, part(i, by + 1:by + 3)) &
                        - f%part(i)*slope(:, by + 1:by + 3)
                  end associate
               end do
            end do
         end associate
      end do
   end subroutine change_of_parts

   !> How the parts of the corners of a triangle and its mean slope change with their places and
   !> heights at the end.
   pure subroutine change_of_field(patch_area, chi, corner, field, part, slope)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(3)
      real(wp), intent(in) :: corner(2, 3, 0:1)
      type(field_t), intent(in) :: field
      real(wp), intent(out) :: part(3, 9), slope(2, 9)
      real(wp) :: lean(2, 3), lean1(2, 3), mean(3)
      real(wp), dimension(3, 2, 3) :: swept, bare
      integer :: l, v

      call patch_moment_slopes(patch_area, corner(:, :, 1), swept, bare)
      lean = gradients(sum(corner, 3)/2.0_wp)
      lean1 = gradients(corner(:, :, 1))
      mean = sum(field%moment, 2)/2.0_wp
      part = 0.0_wp
      slope = 0.0_wp
      do l = 1, 3
         associate (by => 3*(l - 1))
            part(:, by + 1:by + at_eta) = 0.5_wp*matmul(field%share, swept(:, :, l))
            do v = 1, 3
               part(:, by + 1:by + at_eta) = part(:, by + 1:by + at_eta) &
                  - (0.5_wp*mean(v)*field%share(l, v))*transpose(lean)
            end do
            slope(:, by + 1:by + at_eta) = -0.5_wp*outer(lean1(:, l), field%slope(:, 1))
            slope(:, by + at_height) = 0.5_wp*chi(l)*lean1(:, l)
         end associate
      end do
   end subroutine change_of_field

   !> Gradients of the barycentric coordinates of a triangle.
   pure function gradients(corner) result(lean)
      real(wp), intent(in) :: corner(2, 3)
      real(wp) :: lean(2, 3)
      real(wp) :: first(3)

      first = barycentric(corner, unit_corner(:, 1))
      lean(1, :) = barycentric(corner, unit_corner(:, 2)) - first
      lean(2, :) = barycentric(corner, unit_corner(:, 3)) - first
   end function gradients

   !> Add how the closing term changes.
   pure subroutine change_of_closing(patch_area, chi, corner, field, closing, change)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(:)
      real(wp), intent(in) :: corner(:, :)       !! (2, n_vertex) at the end
      type(field_t), intent(in) :: field(:)
      type(closing_t), intent(in) :: closing
      real(wp), intent(inout) :: change(:, :)    !! (3 n_vertex, 3 n_vertex)
      real(wp) :: by_rest(3, size(chi)), by_square(3, size(chi)), area(3*size(chi), size(chi))
      integer :: a, i, j, k

      by_rest = 0.0_wp
      by_square = 0.0_wp
      area = 0.0_wp
      do k = 1, size(field)
         call add_rest(patch_area, chi(field(k)%vertex), corner(:, field(k)%vertex), field(k), &
            by_rest, area)
      end do
      do j = 1, size(chi)
         associate (slope => closing%weight_slope(j)*area(:, j), way => closing%way(:, j))
            by_square(:at_eta, j) = by_square(:at_eta, j) + 2.0_wp*closing%weight(j)*way
            by_square = by_square + sum(way**2)*reshape(slope, shape(by_square))
            do a = 1, at_eta
               i = 3*(j - 1) + a
               change(i, :) = change(i, :) + closing%factor*way(a)*slope
               change(i, i) = change(i, i) + closing%factor*closing%weight(j)
            end do
         end associate
      end do
      by_rest = closing%by_rest*by_rest + closing%by_square*by_square
      do j = 1, size(chi)
         do a = 1, at_eta
            i = 3*(j - 1) + a
            change(i, :) = change(i, :) + closing%weight(j)*closing%way(a, j)*reshape(by_rest, &
               [size(by_rest)])
         end do
      end do
   end subroutine change_of_closing

   !> Add how what a triangle leaves to the rest changes, and what of the patch it covers.
   pure subroutine add_rest(patch_area, chi, corner, field, by_rest, area)
      type(patch_area_t), intent(in) :: patch_area
      real(wp), intent(in) :: chi(3)
      real(wp), intent(in) :: corner(2, 3)       !! at the end
      type(field_t), intent(in) :: field
      real(wp), intent(inout) :: by_rest(:, :)   !! (3, n_vertex)
      real(wp), intent(inout) :: area(:, :)      !! (3 n_vertex, n_vertex) of those at a vertex
      real(wp) :: part(3)
      real(wp), dimension(3, 2, 3) :: swept, bare
      integer :: i, j, v

      call patch_moment_slopes(patch_area, corner, swept, bare)
      part = 0.0_wp
      do v = 1, 3
         part = part + 0.5_wp*(field%moment(v, 1) - field%moment(v, 0)) &
            *barycentric(corner, unit_corner(:, v))
      end do
      do j = 1, 3
         associate (to => by_rest(:, field%vertex(j)), at_j => 3*(field%vertex(j) - 1))
            to(:at_eta) = to(:at_eta) + matmul(sum(field%value, 2)/2.0_wp, swept(:, :, j)) &
               - part(j)*field%slope(:, 1)
            to(at_height) = to(at_height) + part(j)*chi(j)
            do i = 1, 3
               associate (of => area(at_j + 1:at_j + at_eta, field%vertex(i)))
                  of = of + sum(bare(:, :, j), 1)
               end associate
            end do
         end associate
      end do
   end subroutine add_rest

   !> First derivatives by the frame and by the vertices.
   pure subroutine gather_first(at, by, end_by, gap)
      type(frame_vertex_t), intent(in) :: at(:)
      real(wp), intent(in) :: by(:, :), end_by(:, :)   !! (3, n_vertex)
      type(patch_gap_t), intent(inout) :: gap
      integer :: j

      allocate(gap%g(6 + 3*size(at)), gap%c(6 + 3*size(at)), source=0.0_wp)
      do j = 1, size(at)
         gap%df = gap%df + dot_product(by(:, j), at(j)%df)
         associate (place => places(j))
            gap%g(place) = gap%g(place) + matmul(at(j)%g, by(:, j))
            gap%c(place) = gap%c(place) + matmul(at(j)%c, end_by(:, j))
         end associate
      end do
   end subroutine gather_first

   !> Second derivatives by the frame and by the vertices.
   pure subroutine gather_second(at, by, change, gap)
      type(frame_vertex_t), intent(in) :: at(:)
      real(wp), intent(in) :: by(:, :), change(:, :)
      type(patch_gap_t), intent(inout) :: gap
      integer :: j, k, l

      allocate(gap%h(6 + 3*size(at), 6 + 3*size(at)), source=0.0_wp)
      do j = 1, size(at)
         associate (row => places(j))
            do k = 1, 3
               gap%h(row, row) = gap%h(row, row) + by(k, j)*at(j)%h(:, :, k)
            end do
            do l = 1, size(at)
               gap%h(row, places(l)) = gap%h(row, places(l)) + matmul(at(j)%g, &
                  matmul(change(3*j - 2:3*j, 3*l - 2:3*l), transpose(at(l)%c)))
            end do
         end associate
      end do
   end subroutine gather_second

   !> Where the variables of vertex `j` are among all.
   pure function places(j) result(place)
      integer, intent(in) :: j
      integer :: place(n_frame_var)
      integer :: k

      place = [(k, k = 1, 6), (6 + 3*(j - 1) + k, k = 1, 3)]
   end function places

   pure function outer(a, b)
      real(wp), intent(in) :: a(:), b(:)
      real(wp) :: outer(size(a), size(b))

      outer = spread(a, 2, size(b))*spread(b, 1, size(a))
   end function outer

end module emcon_patch_gap_space
