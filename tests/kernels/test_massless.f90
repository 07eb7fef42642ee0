!> Surfaces without mass: which nodes give theirs away, to which, and how it comes back.
module test_massless
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_csr, only : csr_t
   use emcon_errors, only : error_t
   use emcon_host, only : host_add_force, host_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t, march_begin_step, march_free, march_increment, march_init, &
      march_t
   use emcon_massless, only : massless_bare, massless_find, massless_follow, massless_return, &
      massless_shed
   use emcon_motion, only : motion_evaluate
   use emcon_phases, only : phase_enter, phase_vectors
   use emcon_scene, only : scene_t
   use emcon_solid, only : solid_init, solid_t
   use emcon_steps, only : initiation_massless, initiation_persistent, load_point, load_t
   use emcon_system, only : system_respond
   use emcon_term, only : term_box_t
   use emcon_term_registry, only : terms_create, terms_mass_rows, terms_massless
   use emcon_text, only : to_text
   use given_hosts, only : chain_host_init, chain_host_t
   use linear_scenes, only : add_equation
   use small_scenes, only : add_load, add_step, block_t, clamp, make_block, make_two_blocks, shake
   use sparse_samples, only : dense_of
   implicit none
   private
   public :: collect_massless

   real(wp), parameter :: tol = 64.0_wp*max(epsilon(1.0_wp), real(epsilon(1.0_dp), wp))

contains

   subroutine collect_massless(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("nodes that give theirs away", test_find), &
         test_case_t("nodes that a program gives mass or forces", test_given), &
         test_case_t("elements that would keep none", test_keep), &
         test_case_t("sections without inertia", test_bare), &
         test_case_t("to the others of each element", test_shed), &
         test_case_t("mass that comes back", test_return), &
         test_case_t("loads on what has none", test_loads)]
   end subroutine collect_massless

   !> The slave surface of two blocks, nodes 11 to 13, by what the scene has.
   subroutine test_find(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(block_t) :: lower, upper
      logical :: given(16), bare(16), found(16), expected(16)
      integer :: k

      do k = 1, 11
         call make_two_blocks(scene, 0.1_wp, lower, upper)
         call add_step(scene, k == 7, 0.1_wp, 1)
         scene%step(1)%contact%initiation = merge(initiation_persistent, initiation_massless, &
            k == 2)
         if (k == 7) then
            call clamp(scene%step(1), [12])
            call add_step(scene, .false., 0.1_wp, 1)
            scene%step(2)%contact%initiation = initiation_massless
         end if
         if (k == 8) scene%pair = [scene%pair, scene%pair]
         call change(scene, k)
         call solid_init(solid, scene, error)
         if (allocated(error)) return
         given = .false.
         bare = .false.
         if (k == 10) given(11) = .true.
         if (k == 11) bare(1) = .true.
         call massless_find(scene, solid, given, bare, found)
         expected = .false.
         expected(11:13) = .true.
         if (any(k == [2, 3, 4, 5])) expected = .false.
         if (k == 6) expected(12) = .false.
         if (k == 8) expected(6:10) = .true.
         if (k == 9) expected(13) = .false.
         if (k == 10) expected(11) = .false.
         if (k == 11) expected(1) = .true.
         call check_true(error, all(found .eqv. expected), "scene " // to_text(k))
      end do
   end subroutine test_find

   !> What keeps the mass of the pair, or of one node.
   subroutine change(scene, k)
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k

      select case (k)
      case (3)
         scene%pair(1)%initiation = initiation_persistent
      case (4)
         scene%pair(1)%interaction%friction = 0.1_wp
         scene%pair(1)%interaction%rebound = 0.5_wp
      case (5)
         scene%pair(1)%interaction%damping%coefficient = 0.1_wp
      case (6)
         call clamp(scene%step(1), [12])
      case (8)
         scene%pair(2)%slave = 1
         scene%pair(2)%master = 2
      case (9)
         call add_equation(scene, [13, 16], [1, 1], [1.0_wp, -1.0_wp])
      end select
   end subroutine change

   !> Mass at node 12, forces between 11 and 14, and both: of the slave nodes 11 to 13 the others
   !> give theirs away. Their elements' mass is then at the massive nodes alone, and none is lost.
   subroutine test_given(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: extra = 0.5_wp
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(term_box_t), allocatable :: term(:)
      type(chain_host_t) :: chain
      logical :: found(16), bare(16), expected(16)
      real(wp) :: mass(16)
      integer :: k

      call make_two_blocks(scene, 0.1_wp, lower, upper)
      call add_step(scene, .false., 0.1_wp, 1)
      scene%step(1)%contact%initiation = initiation_massless
      do k = 0, 3
         expected = .false.
         expected(11:13) = .true.
         block
            type(host_t) :: host

            if (btest(k, 0)) then
               host%mass%n_row = 16
               host%mass%n_col = 16
               host%mass%row_start = [spread(0, 1, 12), spread(1, 1, 5)]
               host%mass%column = [11]
               host%mass%value = [real(extra, dp)]
               expected(12) = .false.
            end if
            if (btest(k, 1)) then
               call chain_host_init(chain, [11, 14], 16, error)
               if (allocated(error)) return
               call host_add_force(host, chain)
               expected(11) = .false.
            end if
            call terms_create(scene, term, error, host)
         end block
         if (allocated(error)) return
         call terms_massless(term, found, bare)
         call check_true(error, all(found .eqv. expected) .and. .not. any(bare), "given " &
            // to_text(k))
         call terms_mass_rows(term, mass)
         call check_true(error, all((mass > 0.0_wp) .neqv. expected), "mass " // to_text(k))
         call check_near(error, sum(mass), 6.0_wp + merge(extra, 0.0_wp, btest(k, 0)), tol, &
            6.0_wp, "all of it")
      end do
   end subroutine test_given

   !> An element all of whose nodes are on the surface keeps its mass; so do nodes that hang on
   !> fewer others than two.
   subroutine test_keep(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(block_t) :: block
      logical, parameter :: yes = .true., no = .false.
      logical, parameter :: expected(6, 4) = reshape([yes, yes, yes, no, no, no, no, no, no, no, &
         no, no, no, no, yes, no, no, no, no, no, no, no, no, no], [6, 4])
      logical :: none(6), found(6)
      integer :: k

      do k = 1, 4
         call make_block(scene, "CPE4", [2, 1], block)
         call add_step(scene, .false., 0.1_wp, 1)
         scene%step(1)%contact%initiation = initiation_massless
         call node_surface(scene, k)
         call solid_init(solid, scene, error)
         if (allocated(error)) return
         none = .false.
         call massless_find(scene, solid, none, none, found)
         call check_true(error, all(found .eqv. expected(:, k)), "surface " // to_text(k))
      end do
   end subroutine test_keep

   !> A pair whose slave are some nodes, and no master: the lower ones of two elements, all of the
   !> first one, one more, and all but the one between both.
   subroutine node_surface(scene, k)
      use emcon_interactions, only : contact_pair_t
      use emcon_mesh, only : surface_t
      type(scene_t), intent(inout) :: scene
      integer, intent(in) :: k
      type(surface_t) :: surface
      integer, allocatable :: node(:)

      select case (k)
      case (1)
         node = [1, 2, 3]
      case (2)
         node = [1, 2, 4, 5]
      case (3)
         node = [1, 2, 3, 4, 5]
      case default
         node = [1, 2, 3, 4, 6]
      end select
      surface%name = "NODES"
      surface%is_nodal = .true.
      surface%node = node
      allocate(surface%element(0), surface%face(0))
      scene%surface = [surface]
      scene%pair = [contact_pair_t(slave=1, master=0)]
   end subroutine node_surface

   subroutine test_bare(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(block_t) :: block
      logical :: given(8), bare(8)

      call make_block(scene, "CPE4", [3, 1], block)
      scene%section = [scene%section, scene%section]
      scene%element%section = [1, 2, 2]
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      given = .false.
      call massless_bare(scene, solid, given, bare)
      call check_true(error, .not. any(bare), "all have inertia")
      scene%section(2)%is_massless = .true.
      call add_equation(scene, [8, 1], [1, 1], [1.0_wp, -1.0_wp])
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      given(3) = .true.
      call massless_bare(scene, solid, given, bare)
      call check_true(error, all(bare .eqv. [.false., .false., .false., .true., .false., .false., &
         .true., .false.]), "nodes of elements without inertia alone")
   end subroutine test_bare

   !> The mass of a square is 1/36 of 4, 2, 1, 2: two nodes left have a third each, a sixth between.
   subroutine test_shed(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(block_t) :: block
      real(wp) :: expected(4, 4)
      logical :: is_massless(6)

      call make_block(scene, "CPE4", [2, 1], block)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      is_massless = [.true., .true., .false., .false., .false., .false.]
      call massless_shed(solid, is_massless)
      expected = 0.0_wp
      expected(3:, 3:) = reshape([2.0_wp, 1.0_wp, 1.0_wp, 2.0_wp], [2, 2])/6.0_wp
      call check_near(error, solid%mass%consistent(:, :, 1), expected, tol, 1.0_wp, "of two")
      call check_near(error, solid%mass%of_volume(:, 1), [0.0_wp, 0.0_wp, 0.5_wp, 0.5_wp], tol, &
         1.0_wp, "sums of two")
      ! Of three nodes 4 + 4 + 4 + 2 (2 + 1 + 2) = 22, or 2, 4 and 2 on one side.
      expected = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 4.0_wp, 2.0_wp, 1.0_wp, 0.0_wp, &
         2.0_wp, 4.0_wp, 2.0_wp, 0.0_wp, 1.0_wp, 2.0_wp, 4.0_wp], [4, 4])/22.0_wp
      call check_near(error, solid%mass%consistent(:, :, 2), expected, tol, 1.0_wp, "of three")
      call check_near(error, sum(solid%mass%of_volume), 2.0_wp, tol, 1.0_wp, "in all")
   end subroutine test_shed

   !> Node 2 between both squares has half of one; around it have kept mass 4, 5, 6 and 3, where it
   !> is the mean of both elements, of which 5 is in both. What moves with those gets nothing.
   subroutine test_return(error)
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: weight(6) = [0.0_wp, 0.0_wp, 1.0_wp/6.0_wp, 0.25_wp, 5.0_wp/12.0_wp, &
         1.0_wp/6.0_wp]
      type(scene_t) :: scene
      type(solid_t) :: solid
      type(block_t) :: block
      type(csr_t) :: relative
      logical, parameter :: may_be(6) = [.true., .true., .false., .false., .false., .false.]
      logical, parameter :: has(6) = [.false., .true., .false., .false., .false., .false.]
      real(wp) :: v(2, 6), before(2, 6), d(6), mass

      call make_block(scene, "CPE4", [2, 1], block)
      call solid_init(solid, scene, error)
      if (allocated(error)) return
      call massless_return(solid, may_be, has, relative, error)
      if (allocated(error)) return
      d = -weight
      d(2) = 1.0_wp
      mass = 0.5_wp
      call check_near(error, real(dense_of(relative), wp), mass*spread(d, 2, 6)*spread(d, 1, 6), &
         tol, 1.0_wp, "mass")
      call shake(v, 1.0_wp)
      before = v
      call massless_follow(solid, may_be, has, v)
      call check_near(error, v(:, 2), matmul(before, weight), tol, 1.0_wp, "moves with them")
      v(:, 2) = before(:, 2)
      call check_near(error, v, before, 0.0_wp, 1.0_wp, "no others do")
      call check_equal(error, count(has), 1, "one node")
   end subroutine test_return

   !> A block is thrown on a clamped one, forces pull at its massless nodes: as these settle anew
   !> the forces work on them, and the energy stands; then they are in balance with contacts that
   !> push.
   subroutine test_loads(error)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: n_step = 40
      type(scene_t) :: scene
      type(block_t) :: lower, upper
      type(march_t) :: march
      type(increment_t) :: increment
      type(load_t) :: pull
      real(wp) :: total, drift
      integer :: k, n_settled, phase

      call make_two_blocks(scene, 0.0927_wp, lower, upper)
      call add_step(scene, .false., 0.02_wp, n_step)
      scene%step(1)%contact%initiation = initiation_massless
      call clamp(scene%step(1), [(k, k = 1, 5)])
      scene%v0(1, 11:) = 0.3_wp
      scene%v0(2, 11:) = -1.0_wp
      pull%kind = load_point
      pull%place = 2
      do k = 11, 13
         pull%target = k
         pull%value = 2.0_wp*(k - 9)
         call add_load(scene%step(1), pull)
      end do
      call march_init(march, scene, error)
      if (.not. allocated(error)) call march_begin_step(march, scene, 1, error)
      if (allocated(error)) return
      total = march%ledger%total
      drift = 0.0_wp
      n_settled = 0
      do k = 1, n_step
         call march_increment(march, scene, increment, error)
         if (allocated(error)) return
         drift = max(drift, abs(march%ledger%total - total))
         call phase_enter(march%system%phases, phase_vectors, phase)
         call check_equal(error, phase, phase_vectors, "phases that were entered were left")
         if (allocated(error)) return
         if (.not. march%layer%is_settled) cycle
         call check_settled(march, error)
         if (allocated(error)) return
         if (abs(march%layer%work) > 1.0e-4_wp) n_settled = n_settled + 1
      end do
      call check_true(error, n_settled > 0, "forces work on what settles")
      call check_near(error, drift, 0.0_wp, 8.0_wp*real(n_step, wp)*tol, total, "energy")
      call march_free(march)
   end subroutine test_loads

   !> Of a layer that has settled.
   subroutine check_settled(march, error)
      type(march_t), intent(inout) :: march
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: left(:, :)
      integer :: k, i

      associate (layer => march%layer, set => march%layer%active%set)
         call motion_evaluate(layer%motion)
         call system_respond(layer%system, layer%motion, .false., .true.)
         left = layer%system%response%residual
         do k = 1, set%n
            associate (item => set%item(k), m => set%item(k)%n_node)
               left(:, item%node(:m)) = left(:, item%node(:m)) - set%lam(k)*item%c(:, :m)
            end associate
         end do
         do i = 1, size(left, 2)
            if (layer%is_massless(i)) call check_near(error, left(:, i), [0.0_wp, 0.0_wp], &
               1.0e4_wp*tol, maxval(layer%system%response%magnitude), "balance of node " &
               // to_text(i))
         end do
         call check_true(error, count(layer%acts) == set%n .and. all(layer%acts(set%id(:set%n))), &
            "what acts in it acts")
         call check_near(error, layer%lam(set%id(:set%n)), set%lam(:set%n), 0.0_wp, 1.0_wp, &
            "as it pushes")
         call check_near(error, sum(layer%lam), sum(set%lam(:set%n)), tol, 10.0_wp, "and no other")
         call check_true(error, minval(set%lam(:set%n)) >= -tol, "it pushes")
         call check_true(error, .not. any(layer%needs_mass), "none needs mass")
      end associate
   end subroutine check_settled

end module test_massless
