!> Scenes of a few elements for the tests, made by hand.
module small_scenes
   use emcon_element_registry, only : element_kinds_create, find_element_row
   use emcon_interactions, only : contact_pair_t
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_origin, only : origin_t
   use emcon_scene, only : scene_t
   use emcon_scheme_registry, only : scheme_row
   use emcon_steps, only : load_t, prescribed_t, step_t
   use kind_rows, only : law_code
   use random_draws, only : draw_random
   implicit none
   private
   public :: block_t, scene_begin, add_block, block_node, add_surface, add_step, prescribe, clamp
   public :: add_load, make_block, make_two_blocks, bend_scene, shake
   public :: bottom, right, top, left, young, poisson

   !> Sides of a block, counter-clockwise.
   integer, parameter :: bottom = 1, right = 2, top = 3, left = 4
   !> Constants of the first material; its density is 1.
   real(wp), parameter :: young = 100.0_wp, poisson = 0.3_wp

   !> A rectangle of n(1) by n(2) cells; a cell is one CPE4 or two CPE3.
   type :: block_t
      integer :: kind = 0                        !! index into the rows of elements
      integer :: n(2) = 0
      integer :: nodes_before = 0
      integer :: elements_before = 0
   end type block_t

contains

   !> A scene without nodes: one material, one section, in which everything else is empty.
   subroutine scene_begin(scene)
      type(scene_t), intent(out) :: scene

      scene%deck%heading = ""
      allocate(scene%deck%file(0), scene%node%label(0), scene%node%origin(0), scene%x(2, 0))
      allocate(scene%node%turned(0))
      allocate(scene%element%label(0), scene%element%origin(0), scene%element%kind(0))
      call element_kinds_create(2, scene%element%kinds)
      allocate(scene%element%node(4, 0), scene%element%section(0))
      allocate(scene%set%node(0), scene%set%element(0), scene%surface(0), scene%amplitude(0))
      allocate(scene%material(1), scene%section(1), scene%pair(0), scene%step(0))
      allocate(scene%tie(0), scene%equation(0), scene%rigid(0))
      allocate(scene%u0(2, 0), scene%v0(2, 0))
      scene%material(1)%name = "RUBBER"
      scene%material(1)%law = law_code("coupled neo hooke")
      scene%material(1)%constant = [young, poisson]
      scene%material(1)%density = 1.0_wp
      scene%section(1)%set = "ALL"
      scene%section(1)%material = 1
   end subroutine scene_begin

   !> Add a rectangle of elements called `name`; labels are the indices.
   subroutine add_block(scene, name, n, low, extent, block)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name       !! CPE3, CPE4
      integer, intent(in) :: n(2)                !! cells along x and y
      real(wp), intent(in) :: low(2), extent(2)
      type(block_t), intent(out) :: block
      integer :: i, j, corner(4)
      real(wp), allocatable :: x(:, :)

      block = block_t(find_element_row(name), n, size(scene%x, 2), size(scene%element%kind))
      allocate(x(2, (n(1) + 1)*(n(2) + 1)))
      do j = 0, n(2)
         do i = 0, n(1)
            x(:, 1 + i + (n(1) + 1)*j) = low + extent*[real(i, wp)/n(1), real(j, wp)/n(2)]
         end do
      end do
      call widen(scene%x, x)
      call widen(scene%u0, 0.0_wp*x)
      call widen(scene%v0, 0.0_wp*x)
      do j = 1, n(2)
         do i = 1, n(1)
            corner = [block_node(block, i - 1, j - 1), block_node(block, i, j - 1), &
               block_node(block, i, j), block_node(block, i - 1, j)]
            if (name == "CPE4") then
               call add_element(scene, block%kind, corner)
            else
               call add_element(scene, block%kind, [corner(:3), 0])
               call add_element(scene, block%kind, [corner([1, 3, 4]), 0])
            end if
         end do
      end do
      scene%node%label = [(i, i = 1, size(scene%x, 2))]
      scene%element%label = [(i, i = 1, size(scene%element%kind))]
      deallocate(scene%node%origin, scene%element%origin)
      allocate(scene%node%origin(size(scene%x, 2)))
      allocate(scene%element%origin(size(scene%element%kind)))
   end subroutine add_block

   subroutine add_element(scene, kind, node)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: kind, node(4)
      integer, allocatable :: old(:, :)

      call move_alloc(scene%element%node, old)
      allocate(scene%element%node(4, size(old, 2) + 1))
      scene%element%node(:, :size(old, 2)) = old
      scene%element%node(:, size(old, 2) + 1) = node
      scene%element%kind = [scene%element%kind, kind]
      scene%element%section = [scene%element%section, 1]
   end subroutine add_element

   subroutine widen(field, more)
      real(wp), allocatable, intent(inout) :: field(:, :)
      real(wp), intent(in) :: more(:, :)
      real(wp), allocatable :: old(:, :)

      call move_alloc(field, old)
      allocate(field(2, size(old, 2) + size(more, 2)))
      field(:, :size(old, 2)) = old
      field(:, size(old, 2) + 1:) = more
   end subroutine widen

   !> Node in column `i` and row `j` of the block, counted from 0.
   pure integer function block_node(block, i, j)
      type(block_t), intent(in) :: block
      integer, intent(in) :: i, j

      block_node = block%nodes_before + 1 + i + (block%n(1) + 1)*j
   end function block_node

   !> Add the surface made of the sides `sides` of a block, counter-clockwise.
   subroutine add_surface(scene, name, block, sides)
      type(scene_t), intent(inout) :: scene
      character(len=*), intent(in) :: name
      type(block_t), intent(in) :: block
      integer, intent(in) :: sides(:)
      type(surface_t) :: surface
      integer :: k, i, m, cell, per_cell
      !> Faces of the sides: of the quadrilateral, and of the lower and upper triangle.
      integer, parameter :: quad(4) = [1, 2, 3, 4], tri(4) = [1, 2, 2, 3], upper(4) = [0, 0, 1, 1]

      surface%name = name
      allocate(surface%element(0), surface%face(0))
      per_cell = merge(1, 2, scene%element%kinds(block%kind)%n_node == 4)
      do k = 1, size(sides)
         m = block%n(2 - mod(sides(k), 2))
         do i = 1, m
            select case (sides(k))
            case (bottom)
               cell = i
            case (right)
               cell = block%n(1)*i
            case (top)
               cell = block%n(1)*block%n(2) + 1 - i
            case default
               cell = block%n(1)*(m - i) + 1
            end select
            if (per_cell == 1) then
               surface%element = [surface%element, block%elements_before + cell]
               surface%face = [surface%face, quad(sides(k))]
            else
               surface%element = [surface%element, &
                  block%elements_before + 2*cell - 1 + upper(sides(k))]
               surface%face = [surface%face, tri(sides(k))]
            end if
         end do
      end do
      scene%surface = [scene%surface, surface]
   end subroutine add_surface

   !> Add a step with geometric non-linearity and no conditions, of `n` fixed increments `h`.
   subroutine add_step(scene, is_static, h, n)
      type(scene_t), intent(inout) :: scene
      logical, intent(in) :: is_static
      real(wp), intent(in) :: h
      integer, intent(in) :: n
      type(step_t) :: step

      step%origin = origin_t()
      step%scheme = scheme_row(merge("STATIC ", "DYNAMIC", is_static), "")
      step%nlgeom = .true.
      step%time%is_direct = .true.
      step%time%h = h
      step%time%duration = real(n, wp)*h
      allocate(step%prescribed(0), step%load(0), step%output(0))
      scene%step = [scene%step, step]
   end subroutine add_step

   !> Prescribe one degree of freedom.
   subroutine prescribe(step, node, dof, value)
      type(step_t), intent(inout) :: step
      integer, intent(in) :: node, dof
      real(wp), intent(in) :: value
      type(prescribed_t) :: one

      one%node = node
      one%dof = dof
      one%value = value
      step%prescribed = [step%prescribed, one]
   end subroutine prescribe

   !> Hold both degrees of freedom of the nodes.
   subroutine clamp(step, node)
      type(step_t), intent(inout) :: step
      integer, intent(in) :: node(:)
      integer :: i, a

      do i = 1, size(node)
         do a = 1, 2
            call prescribe(step, node(i), a, 0.0_wp)
         end do
      end do
   end subroutine clamp

   subroutine add_load(step, load)
      type(step_t), intent(inout) :: step
      type(load_t), intent(in) :: load

      step%load = [step%load, load]
   end subroutine add_load

   !> One block with its lower left corner at the origin, cells of size 1.
   subroutine make_block(scene, name, n, block)
      type(scene_t), intent(out) :: scene
      character(len=*), intent(in) :: name
      integer, intent(in) :: n(2)
      type(block_t), intent(out) :: block

      call scene_begin(scene)
      call add_block(scene, name, n, [0.0_wp, 0.0_wp], real(n, wp), block)
   end subroutine make_block

   !> A block of 2 x 1 cells that hangs `gap` over one of 4 x 1, lower(1) the lower one; its
   !> bottom is the slave surface, the lower block's top the master surface.
   subroutine make_two_blocks(scene, gap, lower, upper)
      type(scene_t), intent(out) :: scene
      real(wp), intent(in) :: gap
      type(block_t), intent(out) :: lower, upper
      type(contact_pair_t) :: pair

      call scene_begin(scene)
      call add_block(scene, "CPE4", [4, 1], [-2.0_wp, -1.0_wp], [4.0_wp, 1.0_wp], lower)
      call add_block(scene, "CPE4", [2, 1], [-0.875_wp, gap], [2.0_wp, 1.0_wp], upper)
      call add_surface(scene, "LOWER", lower, [top])
      call add_surface(scene, "UPPER", upper, [bottom])
      pair%slave = 2
      pair%master = 1
      scene%pair = [pair]
   end subroutine make_two_blocks

   !> Move all nodes up by `curvature` x^2/2: a circle of that curvature near x = 0.
   pure subroutine bend_scene(scene, curvature)
      type(scene_t), intent(inout) :: scene
      real(wp), intent(in) :: curvature

      scene%x(2, :) = scene%x(2, :) + 0.5_wp*curvature*scene%x(1, :)**2
   end subroutine bend_scene

   !> Random field of entries in (-size, size).
   subroutine shake(field, size)
      real(wp), intent(out) :: field(:, :)
      real(wp), intent(in) :: size

      call draw_random(field)
      field = 2.0_wp*size*(field - 0.5_wp)
   end subroutine shake


end module small_scenes
