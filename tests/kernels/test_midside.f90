!> Midside nodes of contact surfaces and ties: weights, what is handed out, contact of curved sides.
module test_midside
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_couplings, only : tie_rows_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_mortar, &
      formulation_nts, formulation_segment, interaction_t, smoothing_hermite
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_midside_plane, only : midside_distribute, midside_distribute_rows, midside_init, &
      midside_places, midside_points, midside_stretch, midside_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use midside_scenes, only : make_curved_rows, make_rows
   use random_draws, only : draw_random
   implicit none
   private
   public :: collect_midside

   real(wp), parameter :: tol = 64.0_wp*epsilon(1.0_wp)
   integer, parameter :: formulations(4) = [formulation_nts, formulation_nts, &
      formulation_segment, formulation_mortar]

contains

   subroutine collect_midside(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a uniform pressure on a straight side", test_pressure), &
         test_case_t("a node in the middle alone, and ends alone", test_few), &
         test_case_t("contact points turn and move with a curved side", test_rigid), &
         test_case_t("how far they move at most", test_stretch), &
         test_case_t("surfaces of faces, of edges and of nodes", test_surfaces), &
         test_case_t("contact: identity and momenta", test_contact), &
         test_case_t("contact: derivatives", test_derivatives), &
         test_case_t("rows of ties on points and on nodes", test_rows)]
   end subroutine collect_midside

   ! ---- scenes ---------------------------------------------------------------------------------

   !> Contact of surface 2 on surface 1, as formulation `k` of the list, the second one smoothed.
   subroutine make_contact(scene, k, contact, error)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: k
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_options_t) :: options

      call new_contact(scene, contact_pair_t(slave=2, master=1, formulation=formulations(k), &
         interaction=interaction_t(friction=0.2_wp)), contact, error)
      if (allocated(error)) return
      if (k == 2) options%smoothing = smoothing_hermite
      call contact%suit_steps(.false.)
      call contact%configure(scene%x, options)
   end subroutine make_contact

   ! ---- weights --------------------------------------------------------------------------------

   !> Of a straight side of length 2 with its midside node at 1 + d the shape functions have the
   !> integrals 1/3 + 2d/3, 4/3, 1/3 - 2d/3; a pressure on two edges loads their ends by half each.
   subroutine test_pressure(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(midside_t) :: midside
      type(condition_t) :: item
      real(wp) :: d, expected(3)
      integer :: k, side(3)

      do k = 0, 1
         call make_rows(scene)
         side = scene%element%node([1, 2, 5], 3)
         scene%x(:, side) = reshape([0.0_wp, 0.0_wp, 2.0_wp, 0.0_wp, 1.0_wp, 0.0_wp], [2, 3])
         d = 0.2_wp*k
         scene%x(1, side(3)) = 1.0_wp + d
         call midside_init(midside, scene, [2])
         call check_equal(error, midside%n, 1, "sides")
         if (allocated(error)) return
         call condition_resize(item, 3)
         item%n_slave = 3
         item%node = side([3, 1, 2])
         item%g(1, :) = 0.0_wp
         item%g(2, :) = [1.0_wp, 0.5_wp*(1.0_wp + d), 0.5_wp*(1.0_wp - d)]
         item%c = item%g
         call midside_distribute(midside, item)
         expected = [4.0_wp, 1.0_wp + 2.0_wp*d, 1.0_wp - 2.0_wp*d]/3.0_wp
         call check_equal(error, item%node(:item%n_node), side([3, 1, 2]), "nodes")
         call check_equal(error, item%n_slave, 3, "slave nodes")
         call check_near(error, item%g(2, :3), expected, tol, 1.0_wp, "loads")
         call check_near(error, item%g(1, :3), spread(0.0_wp, 1, 3), tol, 1.0_wp, "along the side")
         call check_near(error, item%c(2, :3), expected, tol, 1.0_wp, "at the end")
         deallocate(item%node, item%g, item%c, item%h)
      end do
   end subroutine test_pressure

   !> What pushes at the point in the middle alone is handed to its node and its ends by 4/3 and
   !> -1/6; what pushes at ends alone stays there.
   subroutine test_few(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(midside_t) :: midside
      type(condition_t) :: item
      integer :: k, side(3)

      call make_rows(scene)
      call midside_init(midside, scene, [2])
      side = scene%element%node([1, 2, 5], 3)
      do k = 1, 2
         call condition_resize(item, k)
         item%n_slave = k
         item%node(:k) = merge(side([3, 3]), side([1, 2]), k == 1)
         item%g(:, :k) = reshape([0.5_wp, 1.0_wp, 2.0_wp, 3.0_wp], [2, k])
         item%c = item%g
         item%h = 0.0_wp
         call midside_distribute(midside, item)
         call check_equal(error, item%n_slave, merge(3, 2, k == 1), "slave nodes")
         if (k == 1) call check_equal(error, item%node(:item%n_node), side([3, 1, 2]), "nodes")
         if (k == 2) call check_equal(error, item%node(:item%n_node), side([1, 2]), "the same")
         if (allocated(error)) return
         if (k == 1) call check_near(error, item%g(:, :3), reshape([0.5_wp, 1.0_wp, 0.5_wp, &
            1.0_wp, &
            0.5_wp, 1.0_wp], [2, 3])*spread([8.0_wp, -1.0_wp, -1.0_wp]/6.0_wp, 1, 2), tol, 1.0_wp, &
            "handed out")
         if (k == 2) call check_near(error, item%g(:, :2), reshape([0.5_wp, 1.0_wp, 2.0_wp, &
            3.0_wp], &
            [2, 2]), 0.0_wp, 1.0_wp, "as it was")
      end do
   end subroutine test_few

   !> A motion without strain, from any shape: contact points keep their places in the body, and at
   !> rest they are the nodes.
   subroutine test_rigid(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: angle = 1.1_wp, way(2) = [3.0_wp, -2.0_wp]
      real(wp), parameter :: turn(2, 2) = reshape([cos(angle), sin(angle), -sin(angle), &
         cos(angle)], [2, 2])
      type(scene_t) :: scene
      type(midside_t) :: midside
      real(wp), allocatable :: u(:, :), point(:, :)
      integer :: s

      call make_curved_rows(scene)
      call midside_init(midside, scene, [(s, s = 1, size(scene%surface))])
      call check_equal(error, midside%n, 3, "sides")
      u = matmul(turn, scene%x) - scene%x + spread(way, 2, size(scene%x, 2))
      point = midside_points(midside, u)
      associate (node => midside%node)
         call check_near(error, point(:, node), u(:, node), tol, 4.0_wp, "points")
      end associate
   end subroutine test_rigid

   !> No motion of the nodes by up to 1 moves a point farther than is said, and one does so far.
   subroutine test_stretch(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(midside_t) :: midside
      real(wp), allocatable :: u(:, :), point(:, :)
      real(wp) :: most
      integer :: i, k

      call make_rows(scene)
      call midside_init(midside, scene, [(k, k = 1, size(scene%surface))])
      call check_near(error, midside_stretch(midside), 5.0_wp/3.0_wp, tol, 1.0_wp, "straight")
      call make_curved_rows(scene)
      call midside_init(midside, scene, [(k, k = 1, size(scene%surface))])
      allocate(u, mold=scene%x)
      most = 0.0_wp
      do i = 1, 2000
         call draw_random(u(1, :))
         u(2, :) = sin(8.0_wp*atan(1.0_wp)*u(1, :))
         u(1, :) = cos(8.0_wp*atan(1.0_wp)*u(1, :))
         point = midside_points(midside, u)
         do k = 1, midside%n
            most = max(most, norm2(point(:, midside%side(k)%middle)))
         end do
      end do
      call check_true(error, most <= midside_stretch(midside)*(1.0_wp + tol), "not farther")
      call check_true(error, most > 0.9_wp*midside_stretch(midside), "so far, nearly")
   end subroutine test_stretch

   !> A surface of edges or of nodes has the sides of the elements that they are of.
   subroutine test_surfaces(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(surface_t) :: edges, nodes
      type(midside_t) :: midside(3)
      integer :: k, top(5)

      call make_rows(scene)
      call midside_init(midside(1), scene, [1])
      top = [scene%element%node([3, 7, 4], 2), scene%element%node([7, 4], 1)]
      edges%edge = reshape([top(1:2), top(2:3), top(3:4), top(4:5)], [2, 4])
      nodes%is_nodal = .true.
      allocate(nodes%element(0), nodes%face(0))
      nodes%node = top
      call midside_init(midside(2), scene, [integer ::], edges)
      call midside_init(midside(3), scene, [integer ::], nodes)
      do k = 1, 3
         call check_equal(error, midside(k)%n, 2, "sides of surface " // to_text(k))
         call check_equal(error, midside(k)%side%middle, midside(1)%side%middle, "their middles")
         call check_equal(error, midside(k)%node, midside(1)%node, "nodes")
      end do
      call midside_init(midside(1), scene, [integer ::])
      call check_equal(error, midside(1)%n, 0, "no surface")
   end subroutine test_surfaces

   ! ---- contact --------------------------------------------------------------------------------

   !> Over a motion by a tenth of an edge: gap and slip change by their discrete gradients, which
   !> have neither resultant nor moment at mid-step.
   subroutine test_contact(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t), allocatable :: item(:)
      real(wp), allocatable :: du(:, :), middle(:, :)
      integer :: k, i, m

      call make_curved_rows(scene)
      allocate(du, mold=scene%x)
      call draw_random(du)
      du = 0.1_wp*(du - 0.5_wp)
      middle = scene%x + 0.5_wp*du
      do k = 1, size(formulations)
         call make_contact(scene, k, contact, error)
         if (allocated(error)) return
         call contact%begin_step(scene%x, scene%u0, du)
         call contact%measure(scene%x, scene%u0, du)
         allocate(item(contact%n_constraint))
         item%has_friction = .true.
         call contact%evaluate([(i, i = 1, size(item))], scene%x, scene%u0, du, &
            spread(0.0_wp, 1, size(item)), item)
         do i = 1, size(item)
            m = item(i)%n_node
            call check_near(error, item(i)%gap1 - item(i)%gap0, item(i)%dgap, tol, 1.0_wp, "change")
            call check_directions("gap " // to_text(k), item(i)%g(:, :m), item(i)%dgap)
            call check_directions("slip " // to_text(k), item(i)%t(:, :m, 1), item(i)%slip(1))
            call check_true(error, abs(item(i)%slip(1)) > 0.0_wp, "it slides")
            call check_near(error, contact%slip(i, scene%x, scene%u0, du), item(i)%slip(:1), tol, &
               1.0_wp, "its slip, " // to_text(k))
         end do
         call check_near(error, contact%state%gap1 - contact%state%gap0, [(contact%mean_gap(i, &
            item(i)%gap1) - item(i)%gap0, i = 1, size(item))], tol, 1.0_wp, "as measured")
         call check_areas()
         deallocate(item)
      end do

   contains

      !> Areas are those of the contact points, less what these do not press on.
      subroutine check_areas()
         real(wp), dimension(size(item)) :: area, length, of_points, length_of_points

         call contact%area(scene%x, scene%u0 + du, area, length)
         associate (point => midside_points(contact%midside, scene%u0 + du))
            call contact%area_points(scene%x, point, of_points, length_of_points)
            call contact%narrow(scene%x, point, of_points)
         end associate
         call check_near(error, [area, length], [of_points, length_of_points], 0.0_wp, 1.0_wp, &
            "areas, " // to_text(k))
         call check_true(error, minval(area) > 0.0_wp, "there are areas")
      end subroutine check_areas

      subroutine check_directions(what, g, change)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: g(:, :), change
         real(wp) :: moment

         associate (node => item(i)%node(:m))
            call check_near(error, sum(g*du(:, node)), change, tol, 1.0_wp, what // ": identity")
            call check_near(error, sum(g, 2), [0.0_wp, 0.0_wp], tol, 1.0_wp, what // ": resultant")
            moment = sum(middle(1, node)*g(2, :) - middle(2, node)*g(1, :))
            call check_near(error, moment, 0.0_wp, tol, 1.0_wp, what // ": moment")
         end associate
      end subroutine check_directions

   end subroutine test_contact

   !> Gradients at the end and second derivatives against differences over all nodes: of second
   !> order in a step of 1e-5, and with the round-off of values divided by it.
   subroutine test_derivatives(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: eps = epsilon(1.0_wp)**(1.0_wp/3.0_wp), rel = 1.0e3_wp*eps**2
      type(scene_t) :: scene
      class(contact_t), allocatable :: contact
      type(condition_t) :: item(1), low(1), high(1)
      real(wp), allocatable :: du(:, :), way(:, :)
      real(wp), allocatable :: expected(:, :)
      integer :: k, i, j, m

      call make_curved_rows(scene)
      allocate(du, way, mold=scene%x)
      call draw_random(du)
      du = 0.1_wp*(du - 0.5_wp)
      call draw_random(way)
      way = way - 0.5_wp
      item%has_friction = .true.
      low%has_friction = .true.
      high%has_friction = .true.
      do k = 1, size(formulations)
         call make_contact(scene, k, contact, error)
         if (allocated(error)) return
         call contact%begin_step(scene%x, scene%u0, du)
         call contact%measure(scene%x, scene%u0, du)
         do i = 1, contact%n_constraint
            call contact%evaluate([i], scene%x, scene%u0, du, [0.0_wp], item)
            call contact%evaluate([i], scene%x, scene%u0, du - eps*way, [0.0_wp], low)
            call contact%evaluate([i], scene%x, scene%u0, du + eps*way, [0.0_wp], high)
            m = item(1)%n_node
            associate (w => reshape(way(:, item(1)%node(:m)), [2*m]))
               call check_near(error, sum(item(1)%c(:, :m)*way(:, item(1)%node(:m))), &
                  (high(1)%gap1 - low(1)%gap1)/(2.0_wp*eps), rel, 1.0_wp, "gap " // to_text(k))
               expected = (high(1)%g(:, :m) - low(1)%g(:, :m))/(2.0_wp*eps)
               call check_near(error, matmul(item(1)%h(:2*m, :2*m), w), reshape(expected, [2*m]), &
                  rel, 1.0_wp, "second derivatives of the gap " // to_text(k))
               call check_near(error, sum(item(1)%t1(:, :m, 1)*way(:, item(1)%node(:m))), &
                  (high(1)%slip(1) - low(1)%slip(1))/(2.0_wp*eps), rel, 1.0_wp, &
                  "slip " // to_text(k))
               expected = (high(1)%t(:, :m, 1) - low(1)%t(:, :m, 1))/(2.0_wp*eps)
               call check_near(error, matmul(item(1)%ht(:2*m, :2*m, 1), w), &
                  reshape(expected, [2*m]), rel, 1.0_wp, "second derivatives of the slip " &
                  // to_text(k))
            end associate
            do j = 1, m
               call check_equal(error, count(item(1)%node(:m) == item(1)%node(j)), 1, "once each")
            end do
         end do
      end do
   end subroutine test_derivatives

   ! ---- ties -----------------------------------------------------------------------------------

   !> A row gives the same on nodes as on points, for any places; its weights add up to 0 exactly.
   subroutine test_rows(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(midside_t) :: midside
      type(tie_rows_t) :: points, nodes
      real(wp), allocatable :: x(:, :)
      real(wp) :: sum_of_row
      integer :: k, s

      call make_curved_rows(scene)
      call midside_init(midside, scene, [(k, k = 1, size(scene%surface))])
      associate (own => scene%element%node([1, 2, 5], 3), other => scene%element%node([3, 4, 7], 1))
         points%slave = own([1, 3])
         points%start = [0, 3, 6]
         points%node = [own(1), other(3), other(1), own(3), other(3), other(2)]
      end associate
      points%weight = [0.7_wp, -0.4_wp, -0.3_wp, 0.9_wp, -0.3_wp, -0.6_wp]
      points%size = [0.7_wp, 0.9_wp]
      nodes = points
      call midside_distribute_rows(midside, nodes)
      call check_equal(error, [size(nodes%node), size(nodes%weight)], nodes%start([3, 3]), &
         "entries")
      if (allocated(error)) return
      allocate(x, source=scene%x)
      call midside_places(midside, x)
      call check_true(error, maxval(abs(x - scene%x)) > 1.0e-3_wp, "points off nodes")
      do k = 1, 2
         associate (a => nodes%start(k) + 1, b => nodes%start(k + 1))
            sum_of_row = 0.0_wp
            do s = b, a, -1
               sum_of_row = sum_of_row + nodes%weight(s)
            end do
            call check_equal(error, nodes%node(a), points%slave(k), "first the slave node")
            call check_near(error, sum_of_row, 0.0_wp, 0.0_wp, 1.0_wp, "sum of weights")
            call check_near(error, matmul(scene%x(:, nodes%node(a:b)), nodes%weight(a:b)), &
               matmul(x(:, points%node(3*k - 2:3*k)), points%weight(3*k - 2:3*k)), tol, 1.0_wp, &
               "the row")
         end associate
      end do
   end subroutine test_rows

end module test_midside
