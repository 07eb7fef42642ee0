!> Decks that are given forces: what their cards mean for the model, and restart files.
module test_host_deck
   use check, only : check_equal, check_error, check_near, check_true, test_case_t
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_deck_source, only : passage_t
   use emcon_errors, only : err_input, error_t
   use emcon_kinds, only : dp, wp
   use emcon_march, only : increment_t
   use emcon_restart_data, only : restart_t
   use emcon_stepper, only : stepper_advance, stepper_build, stepper_close, stepper_is_done, &
      stepper_read_text, stepper_t
   use emcon_stepper_file, only : stepper_load, stepper_save
   use emcon_stepper_user, only : stepper_give_force, stepper_give_law, stepper_give_mass, &
      stepper_give_potential
   use emcon_text, only : string_t
   use given_hosts, only : chain_host_init, chain_host_t, well_t
   use given_scenes, only : eps => given_eps, lump
   use stepper_scenes, only : check_same_state
   implicit none
   private
   public :: collect_host_deck

contains

   subroutine collect_host_deck(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("nodes and surfaces of a host", test_cards), &
         test_case_t("all that is given, and a restart", test_restart), &
         test_case_t("nodes that were not given anything", test_left_out)]
   end subroutine collect_host_deck

   !> A chain of three nodes along x, the last one thrown at an element of a given law. The chain
   !> can only push it where it ends in a surface: an edge across x = 2.
   subroutine read_sample(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      character(len=1), parameter :: e = new_line("a")
      character(len=*), parameter :: text = "*NODE" // e // "1, 0., 0." // e // "2, 1., 0." // e &
         // "3, 2., 0." // e // "4, 2., 1." // e // "11, 2.1, 0.2" // e // "12, 2.8, 0.2" // e &
         // "13, 2.8, 0.8" // e // "14, 2.1, 0.8" // e // "*ELEMENT, TYPE=CPE4, ELSET=BLOCK" // e &
         // "1, 11, 12, 13, 14" // e // "*GIVEN FORCES" // e // "*MATERIAL, NAME=WELL" // e &
         // "*USER MATERIAL" // e // "*DENSITY" // e // "2." // e &
         // "*SOLID SECTION, ELSET=BLOCK, MATERIAL=WELL" // e // "*SURFACE, NAME=BLOCK" // e &
         // "BLOCK, S4" // e // "*SURFACE, NAME=END, TYPE=EDGE" // e // "3, 4" // e &
         // "*SURFACE INTERACTION, NAME=HARD" // e // "*CONTACT PAIR, INTERACTION=HARD" // e &
         // "BLOCK, END" // e // "*INITIAL CONDITIONS, TYPE=VELOCITY" // e // "3, 1, 1." // e &
         // "4, 1, 1." // e // "*STEP, NLGEOM" // e // "*DYNAMIC" // e // "0.02, 0.4" // e &
         // "*END STEP" // e
      type(string_t) :: name(1), override(0)

      name(1)%text = "sample.inp"
      call stepper_read_text(stepper, text, [passage_t()], name, override, .false., error)
   end subroutine read_sample

   !> Springs 1-2-3 and 3-4 along x, mass, a law, and a well for nodes 3 and 4.
   subroutine give(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(chain_host_t) :: chain
      type(well_t) :: well
      type(csr_t) :: mass

      call chain_host_init(chain, [1, 2, 3, 4], 8, error)
      if (allocated(error)) return
      chain%c = 2.0_wp
      call stepper_give_force(stepper, chain, error)
      well%n_variable = 2
      well%k = 0.5_wp
      if (.not. allocated(error)) call stepper_give_potential(stepper, "WELL", [3, 4], well, error)
      call lump(mass, 8, 1.0_wp)
      if (.not. allocated(error)) call stepper_give_mass(stepper, mass, error)
      if (.not. allocated(error)) call give_law(stepper, error)
   end subroutine give

   !> W = k |z|^2/2 of the strains z.
   subroutine give_law(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error
      type(well_t) :: law

      law%n_variable = 3
      law%k = 20.0_wp
      call stepper_give_law(stepper, "WELL", law, error)
   end subroutine give_law

   subroutine open_sample(stepper, error)
      type(stepper_t), intent(inout) :: stepper
      type(error_t), allocatable, intent(out) :: error

      call read_sample(stepper, error)
      if (.not. allocated(error)) call give(stepper, error)
   end subroutine open_sample

   subroutine test_cards(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: stepper

      call open_sample(stepper, error)
      if (allocated(error)) return
      call check_equal(error, stepper%scene%host%node, [1, 2, 3, 4], "given nodes")
      call check_equal(error, size(stepper%scene%surface(1)%element), 1, "faces of the block")
      call check_equal(error, reshape(stepper%scene%surface(2)%edge, [2]), [3, 4], "edges")
      call check_equal(error, size(stepper%scene%surface(2)%element), 0, "no faces")
      call stepper_close(stepper)
   end subroutine test_cards

   !> Energy is kept through the impact. Without what was given the file is refused, with it the
   !> second model has the bits of the first one.
   subroutine test_restart(error)
      type(error_t), allocatable, intent(out) :: error
      type(stepper_t) :: first, second
      type(restart_t) :: restart
      type(increment_t) :: increment
      real(wp) :: total
      integer :: k, n_contact

      call open_sample(first, error)
      if (.not. allocated(error)) call stepper_build(first, error)
      if (allocated(error)) return
      total = first%march%ledger%total
      n_contact = 0
      k = 0
      do while (.not. stepper_is_done(first))
         k = k + 1
         if (k == 8) then
            call stepper_save(first, restart)
            call refuse(restart)
            call open_sample(second, error)
            if (.not. allocated(error)) call stepper_load(second, restart, error)
         end if
         if (.not. allocated(error)) call stepper_advance(first, increment, error)
         if (.not. allocated(error) .and. k >= 8) call stepper_advance(second, increment, error)
         if (allocated(error)) return
         n_contact = n_contact + merge(1, 0, increment%n_active > 0)
         if (k >= 8) call check_same_state(error, second, first, "after the restart")
         if (.not. allocated(error)) call check_near(error, first%march%ledger%total, total, &
            32.0_wp*real(k, wp)*eps, total, "energy")
         if (allocated(error)) return
      end do
      call check_true(error, n_contact > 0, "there was contact")
      call check_true(error, first%march%ledger%strain > 0.0_wp, "the block is strained")
      call stepper_close(first)
      call stepper_close(second)

   contains

      !> Nothing given; then all but a force, all but the mass, all but the law.
      subroutine refuse(restart)
         type(restart_t), intent(inout) :: restart
         type(stepper_t) :: bare, part(3)
         type(error_t), allocatable :: raised
         integer :: i

         call stepper_load(bare, restart, raised)
         call check_error(error, raised, err_input, "2 given forces and 1 masses, not with 0", &
            "nothing given")
         do i = 1, 3
            if (.not. allocated(error)) call open_sample(part(i), error)
         end do
         if (allocated(error)) return
         part(1)%host%force = part(1)%host%force(:1)
         part(2)%host%mass = csr_t()
         part(3)%host%law = part(3)%host%law(:0)
         call stepper_load(part(1), restart, raised)
         call check_error(error, raised, err_input, "not with 1 given forces and 1", "no well")
         call stepper_load(part(2), restart, raised)
         call check_error(error, raised, err_input, "not with 2 given forces and 0", "no mass")
         call stepper_load(part(3), restart, raised)
         call check_error(error, raised, err_input, "WELL is a *USER MATERIAL", "no law")
      end subroutine refuse

   end subroutine test_restart

   !> Node 1 has neither forces nor mass.
   subroutine test_left_out(error)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: raised
      type(stepper_t) :: stepper
      type(chain_host_t) :: chain
      type(csr_t) :: mass
      integer, allocatable :: slot(:)

      call read_sample(stepper, error)
      if (.not. allocated(error)) call chain_host_init(chain, [2, 3, 4], 8, error)
      if (.not. allocated(error)) call stepper_give_force(stepper, chain, error)
      if (.not. allocated(error)) call csr_from_elements(mass, 8, [1, 2, 3, 4], [2, 3, 4], slot, &
         error)
      if (allocated(error)) return
      mass%value = 1.0_dp
      call stepper_give_mass(stepper, mass, error)
      if (.not. allocated(error)) call give_law(stepper, error)
      if (allocated(error)) return
      call stepper_build(stepper, raised)
      call check_error(error, raised, err_input, "sample.inp:12: error: *GIVEN FORCES names node " &
         // "1, which has neither", "a node without anything")
      call stepper_close(stepper)
   end subroutine test_left_out

end module test_host_deck
