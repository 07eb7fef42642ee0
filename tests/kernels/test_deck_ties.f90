!> What *TIE and *EQUATION put into the scene.
module test_deck_ties
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_deck, only : deck_read, deck_source_t, diagnostics_t
   use emcon_errors, only : error_t
   use emcon_interactions, only : multiplier_dual, multiplier_standard
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : string_t
   implicit none
   private
   public :: collect_deck_ties

contains

   subroutine collect_deck_ties(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("neither tie nor equation", test_none), &
         test_case_t("options of ties", test_ties), &
         test_case_t("terms of equations", test_equations), &
         test_case_t("sets in equations", test_sets)]
   end subroutine collect_deck_ties

   !> Read a deck of two elements, one above the other, with nodes of their own; `cards` are added.
   !> Lines end in a semicolon; the labels of the nodes descend.
   subroutine read_deck(cards, scene, error)
      character(len=*), intent(in) :: cards
      type(scene_t), intent(out) :: scene
      type(error_t), allocatable, intent(inout) :: error
      type(deck_source_t) :: source
      type(diagnostics_t) :: diagnostics
      type(string_t) :: no_override(0)
      character(len=*), parameter :: head = "*NODE;9,0.,0.;8,1.,0.;7,1.,1.;6,0.,1.;5,0.,1.;" &
         // "4,1.,1.;3,1.,2.;2,0.,2.;1,5.,5.;*ELEMENT, TYPE=CPE4, ELSET=ALL;1,9,8,7,6;2,5,4,3,2;" &
         // "*NSET, NSET=LEFT;6,9;*NSET, NSET=RIGHT;8,7;*SURFACE, NAME=LOW;1,S3;" &
         // "*SURFACE, NAME=HIGH;2,S1;*SURFACE, NAME=FLOOR;1,S1;*SURFACE, NAME=ROOF;2,S3;" &
         // "*MATERIAL, NAME=M;*ELASTIC;1.,0.3;*SOLID SECTION, ELSET=ALL, MATERIAL=M;"
      character(len=*), parameter :: tail = "*STEP;*STATIC;*CLOAD;9,1,1.;*END STEP;"
      integer :: i, n, first, last

      associate (text => head // cards // tail)
         n = count([(text(i:i) == ";", i = 1, len(text))])
         allocate(source%line(n), source%file(n), source%number(n), source%file_name(1))
         source%file_name(1)%text = "deck"
         source%file = 1
         first = 1
         do i = 1, n
            last = index(text(first:), ";") + first - 2
            source%line(i)%text = text(first:last)
            source%number(i) = i
            first = last + 2
         end do
      end associate
      allocate(diagnostics%file_name, source=source%file_name)
      call deck_read(source, no_override, .false., scene, diagnostics)
      call check_equal(error, diagnostics%n_errors, 0, "errors of the deck")
   end subroutine read_deck

   subroutine test_none(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call read_deck("", scene, error)
      if (allocated(error)) return
      call check_true(error, allocated(scene%tie) .and. allocated(scene%equation), "both allocated")
      if (allocated(error)) return
      call check_equal(error, size(scene%tie), 0, "ties")
      call check_equal(error, size(scene%equation), 0, "equations")
   end subroutine test_none

   subroutine test_ties(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: i
      integer, parameter :: slave(3) = [2, 3, 1], master(3) = [1, 4, 4]

      call read_deck("*TIE, NAME=plain;HIGH, LOW;*TIE, NAME=Two, MULTIPLIER=STANDARD," &
         // "POSITION TOLERANCE=0.25;FLOOR, ROOF;LOW, ROOF;", scene, error)
      if (allocated(error)) return
      call check_equal(error, size(scene%tie), 3, "ties")
      if (allocated(error)) return
      call check_equal(error, scene%tie(1)%name, "PLAIN", "name")
      call check_true(error, scene%tie(1)%tolerance < 0.0_wp, "no tolerance given")
      call check_equal(error, scene%tie(1)%multiplier, multiplier_dual, "default multiplier")
      do i = 1, 3
         call check_equal(error, scene%tie(i)%slave, slave(i), "slave surface")
         call check_equal(error, scene%tie(i)%master, master(i), "master surface")
         if (i == 1) cycle
         call check_equal(error, scene%tie(i)%name, "TWO", "name of both lines")
         call check_near(error, scene%tie(i)%tolerance, 0.25_wp, 0.0_wp, 1.0_wp, "tolerance")
         call check_equal(error, scene%tie(i)%multiplier, multiplier_standard, "multiplier")
      end do
      call check_equal(error, scene%tie(3)%origin%line - scene%tie(2)%origin%line, 1, "line")
   end subroutine test_ties

   !> Terms of coefficient 0 are left out; a node may stand in it with both directions.
   subroutine test_equations(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene

      call read_deck("*EQUATION;2;7,2,2.,1,1,-.5;4;5,1,1.,5,2,3.,4,1,0.;1,2,-1.;", scene, error)
      if (allocated(error)) return
      call check_equal(error, size(scene%equation), 2, "equations")
      if (allocated(error)) return
      associate (equation => scene%equation(1))
         call check_equal(error, equation%node, [3, 9], "nodes")
         call check_equal(error, equation%dof, [2, 1], "degrees of freedom")
         call check_near(error, equation%coefficient, [2.0_wp, -0.5_wp], 0.0_wp, 1.0_wp, "factors")
      end associate
      associate (equation => scene%equation(2))
         call check_equal(error, equation%node, [5, 5, 9], "nodes of the second")
         call check_equal(error, equation%dof, [1, 2, 2], "degrees of freedom of the second")
         call check_near(error, equation%coefficient, [1.0_wp, 3.0_wp, -1.0_wp], 0.0_wp, 1.0_wp, &
            "factors of the second")
      end associate
   end subroutine test_equations

   !> Nodes of sets are paired in the order of their labels, here not that of their indices.
   subroutine test_sets(error)
      type(error_t), allocatable, intent(out) :: error
      type(scene_t) :: scene
      integer :: i
      integer, parameter :: left(2) = [4, 1], right(2) = [3, 2]

      call read_deck("*EQUATION;3;RIGHT,1,1.,LEFT,1,-1.,1,1,-1.;", scene, error)
      if (allocated(error)) return
      call check_equal(error, size(scene%equation), 2, "equations")
      if (allocated(error)) return
      do i = 1, 2
         call check_equal(error, scene%equation(i)%node, [right(i), left(i), 9], "nodes")
         call check_equal(error, scene%equation(i)%dof, [1, 1, 1], "degrees of freedom")
      end do
   end subroutine test_sets

end module test_deck_ties
