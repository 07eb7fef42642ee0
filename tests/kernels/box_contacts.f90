!> Contact between two boxes in space, rough ones and steps of them, for tests of what conditions
!> are made of.
module box_contacts
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_pair_t, formulation_mortar, formulation_nts
   use emcon_kinds, only : wp
   use emcon_mesh, only : surface_t
   use emcon_scene, only : scene_t
   use random_draws, only : draw_random
   use space_scenes, only : add_box, skin, space_begin
   use wall_shapes, only : make_wall, turned
   implicit none
   private
   public :: make_boxes, look, draw, draw_on_wall, evaluate, seen, sum_up

   character(len=4), parameter, public :: kind(2) = ["C3D8", "C3D4"]

contains

   !> Two boxes of cells of 1/3, the upper one `gap` above the other and moved by `shift` from it.
   subroutine make_boxes(name, gap, shift, depth, scene, pair)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: gap, shift(2), depth
      type(scene_t), intent(out) :: scene
      type(contact_pair_t), intent(out) :: pair
      type(surface_t) :: surface(2), all_of_it
      integer :: n

      call space_begin(scene)
      call add_box(scene, name, [shift, gap], [1.0_wp, 1.0_wp, 1.0_wp], [3, 3, 3])
      n = size(scene%element%kind)
      call add_box(scene, name, [0.0_wp, 0.0_wp, -depth], [1.0_wp, 1.0_wp, depth], [3, 3, 1])
      all_of_it = skin(scene)
      surface = all_of_it
      surface(1)%element = pack(all_of_it%element, all_of_it%element <= n)
      surface(1)%face = pack(all_of_it%face, all_of_it%element <= n)
      surface(2)%element = pack(all_of_it%element, all_of_it%element > n)
      surface(2)%face = pack(all_of_it%face, all_of_it%element > n)
      scene%surface = surface
      allocate(scene%u0, mold=scene%x)
      scene%u0 = 0.0_wp
      pair%slave = 1
      pair%master = 2
   end subroutine make_boxes

   !> Begin a step and measure.
   subroutine look(contact, scene, du)
      class(contact_t), intent(inout) :: contact
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: du(:, :)

      contact%reach = 0.0_wp
      call contact%begin_step(scene%x, scene%u0, du)
      call contact%measure(scene%x, scene%u0, du)
   end subroutine look

   !> A rough scene and a step in which it slides, turns and is bent.
   subroutine draw(number, size_of, scene, du, contact, error)
      integer, intent(in) :: number              !! odd or even, and that of its half, choose kinds
      real(wp), intent(in) :: size_of
      type(scene_t), intent(out) :: scene
      real(wp), allocatable, intent(out) :: du(:, :)
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: pair
      real(wp) :: turn(3, 3), way(2)

      call draw_random(way)
      call make_boxes(kind(1 + mod(number, 2)), 0.02_wp, 0.4_wp*way, 0.7_wp, scene, pair)
      pair%interaction%friction = 0.3_wp
      pair%formulation = merge(formulation_nts, formulation_mortar, btest(number, 1))
      call new_contact(scene, pair, contact, error)
      if (allocated(error)) return
      call contact%suit_steps(.false.)
      allocate(du, mold=scene%x)
      call draw_random(du)
      scene%u0 = 0.03_wp*(2.0_wp*du - 1.0_wp)
      call draw_random(du)
      turn = 0.0_wp
      turn(1, 2) = -size_of
      turn(2, 1) = size_of
      turn(1, 3) = 0.5_wp*size_of
      turn(3, 1) = -0.5_wp*size_of
      du = 0.1_wp*size_of*(2.0_wp*du - 1.0_wp) + matmul(turn, scene%x)
      associate (last => 64)
         du(1, :last) = du(1, :last) + size_of
      end associate
   end subroutine draw

   !> The same of a box on a plane or, by the number, on a ball, which moves as a rigid body: by
   !> mortar.
   subroutine draw_on_wall(number, size_of, scene, du, contact, error)
      integer, intent(in) :: number
      real(wp), intent(in) :: size_of
      type(scene_t), intent(out) :: scene
      real(wp), allocatable, intent(out) :: du(:, :)
      class(contact_t), allocatable, intent(out) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(contact_pair_t) :: pair
      type(surface_t) :: surface(2)
      real(wp) :: wall_at(3, 4), turn(3, 3)
      integer :: n

      call space_begin(scene)
      call add_box(scene, kind(1 + mod(number/2, 2)), [0.0_wp, 0.0_wp, 0.02_wp], [1.0_wp, 1.0_wp, &
         1.0_wp], [3, 3, 3])
      n = size(scene%x, 2)
      surface(1) = skin(scene)
      allocate(surface(2)%wall)
      call make_wall(1 + mod(number, 2), surface(2)%wall)
      surface(2)%wall%node = [n + 1, n + 2, n + 3, n + 4]
      wall_at = spread([0.5_wp, 0.4_wp, merge(0.0_wp, -1.0_wp, mod(number, 2) == 0)], 2, 4)
      wall_at(3, 2) = wall_at(3, 2) + 1.0_wp
      wall_at(1, 3) = wall_at(1, 3) + 1.0_wp
      wall_at(2, 4) = wall_at(2, 4) + 1.0_wp
      scene%x = reshape([scene%x, wall_at], [3, n + 4])
      scene%surface = surface
      pair%slave = 1
      pair%master = 2
      pair%interaction%friction = 0.3_wp
      pair%formulation = formulation_mortar
      call new_contact(scene, pair, contact, error)
      if (allocated(error)) return
      call contact%suit_steps(.false.)
      allocate(du, mold=scene%x)
      call draw_random(du)
      scene%u0 = 0.03_wp*(2.0_wp*du - 1.0_wp)
      scene%u0(:, n + 1:) = 0.0_wp
      call draw_random(du)
      turn = turned([size_of, 0.5_wp*size_of, 0.0_wp])
      turn(1, 1) = turn(1, 1) - 1.0_wp
      turn(2, 2) = turn(2, 2) - 1.0_wp
      turn(3, 3) = turn(3, 3) - 1.0_wp
      du = 0.1_wp*size_of*(2.0_wp*du - 1.0_wp) + matmul(turn, scene%x)
      du(1, :n) = du(1, :n) + size_of
      du(:, n + 1:) = matmul(turn, scene%x(:, n + 1:))
   end subroutine draw_on_wall

   !> The conditions of the nodes that are over the master.
   subroutine evaluate(contact, scene, du, leaves_second, wanted, item, rubs)
      class(contact_t), intent(inout) :: contact
      type(scene_t), intent(in) :: scene
      real(wp), intent(in), contiguous :: du(:, :)
      logical, intent(in) :: leaves_second
      integer, intent(in) :: wanted(:)
      type(condition_t), allocatable, intent(out) :: item(:)
      logical, intent(in), optional :: rubs      !! with their slips
      integer :: i

      allocate(item(size(wanted)))
      item%leaves_second = leaves_second
      if (present(rubs)) item%has_friction = rubs
      call contact%evaluate(wanted, scene%x, scene%u0, du, [(0.01_wp, i = 1, size(wanted))], item)
   end subroutine evaluate

   !> Those that are over the master at either end.
   function seen(contact) result(wanted)
      class(contact_t), intent(in) :: contact
      integer, allocatable :: wanted(:)
      integer :: i

      wanted = pack([(i, i = 1, contact%n_constraint)], contact%state%is_near)
   end function seen

   !> What forces along `g` do over the motion `du`, half way.
   pure subroutine sum_up(scene, du, node, g, work, sums, magnitude)
      type(scene_t), intent(in) :: scene
      real(wp), intent(in) :: du(:, :)               !! (3, n_node) [L]
      integer, intent(in) :: node(:)                 !! (n) that they act on
      real(wp), intent(in) :: g(:, :)                !! (3, n)
      real(wp), intent(out) :: work                  !! of all of them
      real(wp), intent(out) :: sums(6)               !! resultant, and moment about the origin
      real(wp), intent(out) :: magnitude             !! sum of sizes
      real(wp) :: at(3)
      integer :: j

      work = 0.0_wp
      sums = 0.0_wp
      do j = 1, size(node)
         associate (a => node(j), own => g(:, j))
            at = scene%x(:, a) + scene%u0(:, a) + 0.5_wp*du(:, a)
            work = work + dot_product(own, du(:, a))
            sums = sums + [own, cshift(at, 1)*cshift(own, -1) - cshift(at, -1)*cshift(own, 1)]
         end associate
      end do
      magnitude = sum(abs(g))
   end subroutine sum_up

end module box_contacts
