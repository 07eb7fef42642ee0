!> Corners of polygons that catch as they slide over each other round a curve: when that is told.
module test_interlock
   use check, only : check_equal, check_true, test_case_t
   use emcon_condition_nodes, only : condition_resize
   use emcon_constraints, only : constraints_select
   use emcon_coulomb_law, only : contact_slides, slip_status_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : smoothing_hermite
   use emcon_interlock_plane, only : interlock_tell
   use emcon_kinds, only : wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_init, march_t
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   use ring_scenes, only : make_rings
   use small_scenes, only : add_step
   implicit none
   private
   public :: collect_interlock

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

   !> What slides, and what is told of it: eight edges turn by 11.25 degrees.
   type :: case_t
      integer :: n_edge = 8                      !! of the sleeve; 8 of the hub
      real(wp) :: mu = 0.3_wp
      real(wp) :: angle = 17.5_wp                !! of the third push [degrees]
      integer :: n_slide = 3
      real(wp) :: path = 1.1_wp                  !! of the third contact, per edge
      logical :: is_curved = .false., is_own = .false.
      logical :: is_told = .false., knows = .false.
   end type case_t

contains

   subroutine collect_interlock(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [test_case_t("corners that catch", test_told)]
   end subroutine collect_interlock

   subroutine test_told(error)
      type(error_t), allocatable, intent(out) :: error
      type(case_t), allocatable :: row(:)
      integer :: k

      row = [ &
         case_t(is_told=.true., knows=.true.), &
         case_t(angle=-17.5_wp, is_told=.true., knows=.true.), &
         ! Pushes that spread by less than one and a half turns.
         case_t(angle=16.0_wp), &
         case_t(n_slide=2), &
         case_t(path=0.9_wp), &
         case_t(mu=0.0_wp), &
         ! tan(5.625 degrees)/mu is a tenth at 0.985.
         case_t(mu=0.97_wp, is_told=.true., knows=.true.), &
         case_t(mu=1.0_wp, knows=.true.), &
         ! Friction of which the spread is no tenth.
         case_t(mu=3.2_wp), &
         case_t(is_curved=.true., knows=.true.), &
         case_t(is_curved=.true., is_own=.true., knows=.true.), &
         ! Edges of both sides that are more or less than three times as long.
         case_t(n_edge=22, angle=5.0_wp, mu=0.2_wp), &
         case_t(n_edge=22, is_told=.true., knows=.true.), &
         case_t(n_edge=26, knows=.true.)]
      do k = 1, size(row)
         call look_at(error, row(k), "case " // to_text(k))
         if (allocated(error)) return
      end do
   end subroutine test_told

   subroutine look_at(error, row, what)
      type(error_t), allocatable, intent(inout) :: error
      type(case_t), intent(in) :: row
      character(len=*), intent(in) :: what
      type(scene_t) :: scene
      type(march_t) :: march
      type(increment_t) :: increment

      call make_rings(scene, [8, row%n_edge], 0.0_wp, .false.)
      scene%pair(1)%interaction%friction = max(row%mu, 0.01_wp)
      call add_step(scene, .false., 0.1_wp, 1)
      if (row%is_curved .and. .not. row%is_own) scene%step(1)%contact%options%smoothing &
         = smoothing_hermite
      scene%pair(1)%has_options = row%is_own
      if (row%is_own) scene%pair(1)%options%smoothing = smoothing_hermite
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      scene%pair(1)%interaction%friction = row%mu
      call let_slide(march, row)
      call interlock_tell(march, scene, increment)
      call check_equal(error, increment%warnings%n, merge(1, 0, row%is_told), what // ", told")
      call check_true(error, march%active%friction%knows_corners(1) .eqv. row%knows, what &
         // ", known")
      call interlock_tell(march, scene, increment)
      call check_equal(error, increment%warnings%n, merge(1, 0, row%is_told), what // ", once")
      call march_free(march)
   end subroutine look_at

   !> Contacts 2 to 4, of which the first ones slide; 5 is a long way round, but sticks. 1 and 6,
   !> which are too, are of other pairs. All of it is turned.
   subroutine let_slide(march, row)
      type(march_t), intent(inout) :: march
      type(case_t), intent(in) :: row
      real(wp) :: angle(6)
      integer :: k

      angle = [80.0_wp, 0.0_wp, -5.0_wp, row%angle, 80.0_wp, 80.0_wp]*degree + 0.5_wp
      march%system%first_constraint(:2) = [1, 5]
      call constraints_select(march%active%set, [1, 2, 3, 4, 5, 6])
      associate (set => march%active%set, contacts => march%state%contacts)
         set%lam = 2.0_wp
         contacts%slip_path = 1.0_wp
         do k = 1, 6
            call condition_resize(set%item(k), 2)
            set%item(k)%n_slave = 1
            set%item(k)%c(:, 1) = [cos(angle(k)), sin(angle(k))]
            set%item(k)%c(:, 2) = -set%item(k)%c(:, 1)
            set%item(k)%size = 0.25_wp
            if (k <= row%n_slide + 1 .or. k == 6) march%active%friction%law(k)%status &
               = slip_status_t(contact_slides, [1.0_wp, 0.0_wp])
         end do
         contacts%slip_path(4) = 0.25_wp*row%path
      end associate
   end subroutine let_slide

end module test_interlock
