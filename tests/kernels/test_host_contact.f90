!> Contact that a program gives: what it has to have, and what is asked of it before the first step.
module test_host_contact
   use check, only : check_equal, check_error, check_true, test_case_t
   use emcon_constraint, only : condition_t
   use emcon_contact, only : contact_t, gap_state_t
   use emcon_contact_registry, only : new_contact
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host, only : host_add_contact, host_find_contact, host_t
   use emcon_host_contact, only : host_contact_t
   use emcon_initial_contact, only : initial_contact_prepare
   use emcon_interactions, only : contact_options_t, contact_pair_t, formulation_user
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_surface_nodes, only : surface_nodes
   use emcon_text, only : notes_t
   use small_scenes, only : block_t, make_two_blocks
   implicit none
   private
   public :: collect_host_contact

   !> Nodes in front of the line y = 0.
   type, extends(host_contact_t) :: floor_t
      character(len=12) :: fault = ""            !! of `set_up`
   contains
      procedure :: set_up
      procedure :: configure
      procedure :: begin_points
      procedure :: measure_points
      procedure :: evaluate_points
      procedure :: area_points
   end type floor_t

contains

   subroutine collect_host_contact(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("what is left out is filled in", test_set_up), &
         test_case_t("faults are told with the pair", test_faults), &
         test_case_t("gaps at the start", test_start), &
         test_case_t("formulations by pairs", test_list)]
   end subroutine collect_host_contact

   subroutine set_up(self, scene, pair, error)
      class(floor_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(error_t), allocatable, intent(out) :: error

      call surface_nodes(scene, scene%surface(pair%slave), self%node)
      self%n_constraint = size(self%node)
      select case (self%fault)
      case ("negative")
         self%n_constraint = -1
      case ("no node")
         deallocate(self%node)
      case ("short node")
         self%node = self%node(2:)
      case ("far node")
         self%node(1) = size(scene%x, 2) + 1
      case ("long state")
         allocate(self%state(self%n_constraint + 1))
      case ("own")
         call raise(error, err_input, "its own fault")
      end select
   end subroutine set_up

   pure subroutine configure(self, x, options)
      class(floor_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :)
      type(contact_options_t), intent(in) :: options

      associate (unused => self, nor_these => x, nor_those => options)
      end associate
   end subroutine configure

   pure subroutine begin_points(self, x, u0, du)
      class(floor_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      associate (unused => x, nor_these => u0, nor_those => du)
      end associate
      call self%has_looked(0.0_wp)
   end subroutine begin_points

   pure subroutine measure_points(self, x, u0, du)
      class(floor_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)

      self%state = gap_state_t(is_near=.true., is_over=.true., size=1.0_wp)
      self%state%gap0 = x(2, self%node) + u0(2, self%node)
      self%state%gap1 = self%state%gap0 + du(2, self%node)
   end subroutine measure_points

   pure subroutine evaluate_points(self, wanted, x, u0, du, target, item)
      class(floor_t), intent(inout) :: self
      integer, intent(in) :: wanted(:)
      real(wp), intent(in), contiguous :: x(:, :), u0(:, :), du(:, :)
      real(wp), intent(in) :: target(:)
      type(condition_t), intent(inout) :: item(:)

      item%gap0 = x(2, self%node(wanted)) + u0(2, self%node(wanted)) - target
      item%dgap = du(2, self%node(wanted))
   end subroutine evaluate_points

   pure subroutine area_points(self, x, u, area, length)
      class(floor_t), intent(in) :: self
      real(wp), intent(in), contiguous :: x(:, :), u(:, :)
      real(wp), intent(out) :: area(:), length(:)

      associate (unused => self, nor_these => x, nor_those => u)
      end associate
      area = 1.0_wp
      length = 1.0_wp
   end subroutine area_points

   subroutine test_set_up(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      class(contact_t), allocatable :: contact

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      scene%pair%formulation = formulation_user
      call new_contact(scene, scene%pair(1), contact, error, floor_t())
      if (allocated(error)) return
      call check_equal(error, [size(contact%state), size(contact%duplicate), &
         size(contact%thickness), size(contact%sagitta)], [3, 3, 3, 3], "one each")
      call check_true(error, contact%max_penetration_at_start > 0.0_wp, "gaps of 0 are closed")
   end subroutine test_set_up

   subroutine test_faults(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      class(contact_t), allocatable :: contact

      call make_two_blocks(scene, 0.0_wp, lower, upper)
      scene%pair%formulation = formulation_user
      call expect("negative", "n_constraint = -1 is negative")
      call expect("no node", "node is not allocated")
      call expect("short node", "the size of node is 2, not n_constraint = 3")
      call expect("far node", "is not in 1..")
      call expect("long state", "the size of state is 4")
      call expect("own", "TYPE=USER of surfaces " // scene%surface(scene%pair(1)%slave)%name)
      call expect("own", ": its own fault")
      call new_contact(scene, scene%pair(1), contact, raised)
      call check_error(error, raised, err_input, "no program has given this contact", "not given")

   contains

      subroutine expect(fault, words)
         character(len=*), intent(in) :: fault, words

         call new_contact(scene, scene%pair(1), contact, raised, floor_t(fault=fault))
         call check_error(error, raised, err_input, words, fault)
      end subroutine expect

   end subroutine test_faults

   !> Nodes that touch pass, nodes behind the surface are named.
   subroutine test_start(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(notes_t) :: notes
      type(host_t) :: given

      call host_add_contact(given, 1, floor_t())
      call make_two_blocks(scene, 0.0_wp, lower, upper)
      scene%pair%formulation = formulation_user
      call initial_contact_prepare(scene, notes, error, given)
      if (allocated(error)) return
      call make_two_blocks(scene, -0.125_wp, lower, upper)
      scene%pair%formulation = formulation_user
      call initial_contact_prepare(scene, notes, raised, given)
      call check_error(error, raised, err_input, "3 slave nodes of surface", "overlap")
      call check_error(error, raised, err_input, "by 0.125 at most", "its depth")
   end subroutine test_start

   !> Given in any order, each stays with its pair.
   subroutine test_list(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: pair(3) = [5, 2, 3]
      character(len=12), parameter :: fault(3) = ["fifth ", "second", "third "]
      type(host_t) :: given
      integer :: k

      call check_equal(error, host_find_contact(given, 2), 0, "nothing yet")
      do k = 1, size(pair)
         call host_add_contact(given, pair(k), floor_t(fault=fault(k)))
      end do
      call check_equal(error, [(host_find_contact(given, k), k = 1, 5)], [0, 2, 3, 0, 1], "found")
      do k = 1, size(pair)
         select type (contact => given%contact(k)%contact)
         type is (floor_t)
            call check_equal(error, trim(contact%fault), trim(fault(k)), "its formulation")
         class default
            call check_true(error, .false., "a formulation of its own kind")
         end select
      end do
   end subroutine test_list

end module test_host_contact
