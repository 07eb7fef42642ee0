!> Nodes without mass that take it back: which do, and that a body in flight notices nothing.
module test_mass_return
   use check, only : check_near, check_true, test_case_t
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_ledger, only : ledger_t
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_march_begin, only : march_renumber
   use emcon_mass_return, only : mass_find_troubled, mass_return
   use emcon_scene, only : scene_t
   use emcon_steps, only : initiation_massless
   use emcon_system, only : mass_times
   use emcon_term_registry, only : terms_massless
   use emcon_text, only : to_text
   use small_scenes, only : add_step, block_t, make_two_blocks
   implicit none
   private
   public :: collect_mass_return

   real(wp), parameter :: eps = max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))
   !> Round-off of some steps.
   real(wp), parameter :: tol = 256.0_wp*eps
   integer, parameter :: n_node = 16
   !> Nodes without mass: the slave surface, as one side of two is enough.
   integer, parameter :: surface(3) = [11, 12, 13]
   !> Failures of increments before masses come back.
   integer, parameter :: return_after = 3

contains

   subroutine collect_mass_return(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("which nodes are to blame", test_troubled), &
         test_case_t("a body in flight notices nothing", test_flight), &
         test_case_t("after some failures in a row", test_failures)]
   end subroutine collect_mass_return

   !> A block of mass 2 that flies over one of mass 4, far above it; both are free.
   subroutine begin(scene, march, error)
      type(scene_t), intent(out) :: scene
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      type(block_t) :: lower, upper

      call make_two_blocks(scene, 1.0_wp, lower, upper)
      call add_step(scene, .false., 0.02_wp, 10)
      scene%step(1)%contact%initiation = initiation_massless
      scene%v0(1, 11:) = 0.5_wp
      scene%v0(2, 11:) = -1.0_wp
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
   end subroutine begin

   subroutine test_troubled(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment

      call begin(scene, march, error)
      if (.not. allocated(error)) call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      march%layer%needs_mass = .false.
      march%layer%needs_mass(11) = .true.
      call expect([11, 12], .true., "the balance of the layer failed at 11")
      march%layer%needs_mass = .false.
      march%newton%left = 0.0_wp*scene%x
      march%newton%left(:, 13) = [0.0_wp, -2.0_wp]
      march%newton%left(:, 11) = 1.0_wp
      march%newton%left(:, 15) = 3.0_wp
      call expect([12, 13], .true., "what is left at 13 is most without mass")
      march%newton%left = 0.0_wp
      call expect(surface, .true., "nothing tells one from the other")
      march%active%is_active(march%system%first_constraint(1) + 3) = .true.
      associate (node => march%system%contact(1)%contact%node(3))
         call expect(pack([11, 12, 13], abs([11, 12, 13] - node) <= 1), .false., "contact 3 acts")
      end associate
      call march_free(march)

   contains

      subroutine expect(node, has_residual, what)
         integer, intent(in) :: node(:)
         logical, intent(in) :: has_residual
         character(len=*), intent(in) :: what
         logical :: needs_mass(n_node), expected(n_node)

         expected = .false.
         expected(node) = .true.
         call mass_find_troubled(march, scene, has_residual, needs_mass)
         call check_true(error, all(needs_mass .eqv. expected), what)
      end subroutine expect

   end subroutine test_troubled

   !> Contacts close as those of the layer do where their slave node has no mass.
   subroutine check_marks(error, march)
      type(error_t), allocatable, intent(inout) :: error
      type(march_t), intent(in) :: march
      integer :: i, k

      do i = 1, size(march%system%contact)
         associate (contact => march%system%contact(i)%contact)
            do k = 1, contact%n_constraint
               call check_true(error, march%active%rules%closes(march%system%first_constraint(i) &
                  + k) .eqv. march%layer%is_massless(contact%node(k)), "marks")
            end do
         end associate
      end do
   end subroutine check_marks

   !> Masses are whole again, and energy and momenta stay when they come back and after that.
   subroutine test_flight(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment
      type(ledger_t) :: start
      real(wp), dimension(2, n_node) :: field, product
      logical, dimension(n_node) :: is_back, is_massless, is_bare
      integer :: k

      call begin(scene, march, error)
      if (allocated(error)) return
      start = march%ledger
      call march_increment(march, scene, increment, error)
      if (allocated(error)) return
      call check_true(error, all(march%layer%is_massless(surface)), "without mass")
      call check_marks(error, march)
      if (allocated(error)) return
      is_back = .false.
      is_back([11, 12]) = .true.
      ! What has no mass moves with what has: its own velocity counts for nothing.
      march%state%v(:, 11:12) = 7.0_wp
      call mass_return(march, scene, is_back, error)
      if (.not. allocated(error)) call march_renumber(march, scene, error)
      if (allocated(error)) return
      call check_true(error, .not. any(march%layer%is_massless(11:12)) .and. &
         march%layer%is_massless(13), "two have it again")
      call check_marks(error, march)
      call terms_massless(march%system%term, is_massless, is_bare)
      call check_true(error, all(is_massless .eqv. march%layer%is_massless) .and. .not. &
         any(is_bare), "the model says the same")
      call check_near(error, march%state%v(:, 11:12), reshape([0.5_wp, -1.0_wp, 0.5_wp, -1.0_wp], &
         [2, 2]), tol, 1.0_wp, "velocities")
      field(1, :) = 1.0_wp
      field(2, :) = scene%x(1, :)
      call mass_times(march%system, field, product)
      call check_near(error, sum(product, 2), [6.0_wp, 2.0_wp*0.125_wp], tol, 6.0_wp, &
         "mass and its moment")
      ! Node 11 is of one element of four nodes, and moves against the others there.
      field = 0.0_wp
      field(1, 11) = 1.0_wp
      call mass_times(march%system, field, product)
      call check_near(error, [product(1, 11), sum(product(1, :))], [0.25_wp, 0.0_wp], tol, 1.0_wp, &
         "its own mass")
      do k = 2, 4
         if (allocated(error)) return
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         call check_near(error, [march%ledger%total, march%ledger%momentum, &
            march%ledger%angular], [start%total, start%momentum, start%angular], tol, &
            start%total, "energy and momenta")
      end do
      call march_free(march)
   end subroutine test_flight

   !> Increments on the grid and by the error: what cannot be solved is tried shorter, then masses
   !> come back.
   subroutine test_failures(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: stopped
      type(scene_t) :: scene
      type(increment_t) :: increment
      integer :: k, i, n_told

      do k = 1, 2
         block
            type(march_t) :: march

            call begin(scene, march, error)
            if (allocated(error)) return
            if (k == 2) then
               scene%step(1)%time%is_direct = .false.
               scene%step(1)%time%tolerance = 0.1_wp
            end if
            ! A single iteration for a large motion.
            scene%step(1)%solution%newton_maximum = 1
            march%state%v(1, 14:16) = 30.0_wp
            march%state%v(2, 11:16:2) = 40.0_wp
            call march_begin_step(march, scene, 1, error)
            if (allocated(error)) return
            ! As a step before may have left it.
            march%layer%needs_mass(11) = .true.
            call march_increment(march, scene, increment, stopped)
            n_told = 0
            do i = 1, increment%notes%n
               associate (text => increment%notes%item(i)%text)
                  if (index(text, "contact nodes get their mass back: ") > 0) then
                     n_told = n_told + 1
                     call check_true(error, index(text, "back: 11, 12, " // &
                        "13") > 0 .or. digits(1.0_wp) &
                        < digits(1.0_dp), text)
                  end if
               end associate
               if (n_told == 0) call check_true(error, i <= return_after, "after few failures")
            end do
            call check_true(error, n_told == 1, "masses come back, kind " // to_text(k) // ": " &
               // to_text(n_told))
            call check_true(error, .not. any(march%layer%is_massless), "all of them")
            call check_true(error, march%step_check%ratio >= 0.0_wp .eqv. k == 2, &
               "what follows is judged by its error, if that counts")
            call march_free(march)
         end block
         if (allocated(error)) return
      end do
   end subroutine test_failures

end module test_mass_return
