!> Files of triangles, as text and binary, and surfaces made of their triangles.
module test_stl
   use check, only : check_equal, check_near, check_true, test_case_t
   use emcon_deck_stl_file_space, only : stl_corners
   use emcon_errors, only : error_t
   use emcon_kinds, only : dp, wp
   use emcon_triangle_soup_space, only : soup_join, soup_t
   implicit none
   private
   public :: collect_stl

   character(len=*), parameter :: new_line = achar(10)
   !> Corners of a tetrahedron, and its faces seen from outside.
   real(wp), parameter :: place(3, 4) = reshape([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
      0.0_wp, 2.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 3.0_wp], [3, 4])
   integer, parameter :: face(3, 4) = reshape([1, 3, 2, 1, 2, 4, 2, 3, 4, 1, 4, 3], [3, 4])

contains

   subroutine collect_stl(tests)
      type(test_case_t), allocatable, intent(out) :: tests(:)

      tests = [ &
         test_case_t("a text", test_text), &
         test_case_t("a text with faults", test_text_faults), &
         test_case_t("a binary file", test_binary), &
         test_case_t("triangles of a body", test_closed), &
         test_case_t("triangles that are turned, flat or missing", test_mended), &
         test_case_t("two bodies, one in the other", test_two), &
         test_case_t("triangles that branch", test_branch)]
   end subroutine collect_stl

   !> Words in any case, several solids, all line ends, numbers of Fortran and C.
   subroutine test_text(error)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: corner(:, :, :)
      character(len=:), allocatable :: fault

      call stl_corners(new_line // " SOLID a" // achar(13) // new_line // loop("0 0 0", &
         "1.5e0 0 0", " -2D-1" // achar(9) // "+.5 7") // "endsolid a" // new_line // &
         "solid" // new_line // loop("1 2 3", "4 5 6", "7 8 10") // "ENDSOLID", corner, fault)
      call check_equal(error, fault, "", "fault")
      if (allocated(error)) return
      call check_equal(error, size(corner, 3), 2, "facets")
      call check_true(error, all(abs(corner(:, 2, 1) - [1.5_dp, 0.0_dp, 0.0_dp]) <= 0.0_dp), &
         "second")
      call check_true(error, all(abs(corner(:, 3, 1) - [-0.2_dp, 0.5_dp, 7.0_dp]) <= &
         real(epsilon(1.0_wp), dp)), "third")
      call check_true(error, all(abs(corner(:, 3, 2) - [7.0_dp, 8.0_dp, 10.0_dp]) <= 0.0_dp), &
         "last")
   end subroutine test_text

   subroutine test_text_faults(error)
      type(error_t), allocatable, intent(out) :: error

      call expect("solid" // new_line // loop("0 0 0", "1 0 0", "0 1") // "endsolid", &
         "line 6: expected three numbers")
      call expect("solid" // new_line // loop("0 0 0", "1 0 0", "0 1 0 0") // "endsolid", &
         "line 6: expected three numbers")
      call expect("solid" // new_line // loop("0 0 0", "1 0 inf", "0 1 0") // "endsolid", &
         "line 5: expected three numbers")
      call expect("solid" // new_line // loop("0 0 0", "1 0 0", "0 1 0"), "line 8: the file ends")
      call expect("solid" // new_line // "endsolid", "no facet")
      call expect("solid" // new_line // "endsolid" // new_line // "facet", &
         "line 3: expected 'solid'")
      call expect("", "byte 0")

   contains

      subroutine expect(text, words)
         character(len=*), intent(in) :: text, words
         real(dp), allocatable :: corner(:, :, :)
         character(len=:), allocatable :: fault

         call stl_corners(text, corner, fault)
         call check_true(error, index(fault, words) > 0, words // " in: " // fault)
      end subroutine expect

   end subroutine test_text_faults

   !> Numbers of single precision, byte by byte; a count of more than what follows.
   subroutine test_binary(error)
      type(error_t), allocatable, intent(out) :: error
      character(len=4), parameter :: one = achar(0) // achar(0) // char(128) // char(63)
      character(len=4), parameter :: not_a_number = achar(0) // achar(0) // char(192) // char(127)
      real(dp), allocatable :: corner(:, :, :)
      character(len=:), allocatable :: head, fault

      head = "solid" // repeat(achar(0), 75) // achar(1) // repeat(achar(0), 3)
      call stl_corners(head // repeat(achar(0), 12) // repeat(one, 9) // "ab", corner, fault)
      call check_equal(error, fault, "", "fault")
      if (allocated(error)) return
      call check_true(error, all(abs(corner(:, :, 1) - 1.0_dp) <= 0.0_dp), "ones")
      call stl_corners(head // repeat(achar(0), 12) // repeat(one, 8) // not_a_number // "ab", &
         corner, fault)
      call check_true(error, index(fault, "byte 129: a coordinate of facet 1") > 0, fault)
      call stl_corners(head // repeat(achar(0), 12) // repeat(one, 9) // "a", corner, fault)
      call check_true(error, index(fault, "has 134 bytes, but this one has 133") > 0, fault)
      call stl_corners(head(:80) // repeat(char(255), 4) // "a", corner, fault)
      call check_true(error, index(fault, "has 214748364834 bytes") > 0, fault)
   end subroutine test_binary

   subroutine test_closed(error)
      type(error_t), allocatable, intent(out) :: error
      type(soup_t) :: soup
      real(wp) :: corner(3, 3, 4)
      integer :: f

      call triangles(corner)
      call soup_join(soup, corner)
      call check_equal(error, size(soup%point, 2), 4, "points")
      call check_equal(error, soup%turned%n + soup%flat%n + soup%open%n + soup%branch%n, 0, &
         "odd ones")
      call check_true(error, .not. soup%is_inward, "faces outwards")
      if (allocated(error)) return
      do f = 1, 4
         call check_true(error, all(abs(soup%point(:, soup%facet(:, f)) - corner(:, :, f)) <= &
            0.0_wp), "corners in their order")
      end do
      call soup_join(soup, corner(:, [1, 3, 2], :))
      call check_true(error, soup%is_inward, "faces inwards")
      call check_equal(error, soup%turned%n, 0, "turned")
   end subroutine test_closed

   subroutine test_mended(error)
      type(error_t), allocatable, intent(out) :: error
      type(soup_t) :: soup
      real(wp) :: corner(3, 3, 5)

      call triangles(corner(:, :, :4))
      corner(:, :, 5) = corner(:, [2, 2, 1], 3)
      corner(:, :, 3) = corner(:, [2, 1, 3], 3)
      ! As far off as digits of files are.
      corner(:, 1, 4) = corner(:, 1, 4) + 1.0e-7_wp
      call soup_join(soup, corner)
      call check_equal(error, size(soup%point, 2), 4, "points")
      call check_equal(error, soup%turned%n, 1, "turned")
      call check_equal(error, soup%turned%first, 3, "which")
      call check_equal(error, soup%flat%n, 1, "flat")
      call check_equal(error, soup%flat%first, 5, "which")
      call check_equal(error, soup%open%n, 0, "open")
      call check_true(error, .not. soup%is_inward, "faces outwards")
      call soup_join(soup, corner(:, :, [1, 2, 4]))
      call check_equal(error, soup%open%n, 3, "sides of a hole")
      call check_equal(error, size(soup%point, 2), 4, "points around a hole")
      corner(:, 1, 4) = corner(:, 1, 4) + 1.0e-3_wp
      call soup_join(soup, corner(:, :, :4))
      call check_equal(error, size(soup%point, 2), 5, "points that are apart")
      call check_equal(error, soup%open%n, 4, "sides about a slit")
   end subroutine test_mended

   !> A majority is one of what hangs together: a small hole in a large body faces inwards.
   subroutine test_two(error)
      type(error_t), allocatable, intent(out) :: error
      type(soup_t) :: soup
      real(wp) :: corner(3, 3, 8)

      call triangles(corner(:, :, :4))
      corner(:, :, 5:) = 0.1_wp + 0.1_wp*corner(:, [1, 3, 2], :4)
      call soup_join(soup, corner)
      call check_equal(error, size(soup%point, 2), 8, "points")
      call check_equal(error, soup%turned%n, 0, "turned")
      call check_true(error, .not. soup%is_inward, "encloses more than its hole does")
   end subroutine test_two

   subroutine test_branch(error)
      type(error_t), allocatable, intent(out) :: error
      type(soup_t) :: soup
      real(wp) :: corner(3, 3, 5)

      call triangles(corner(:, :, :4))
      corner(:, :, 5) = corner(:, :, 2)
      corner(2, 3, 5) = -1.0_wp
      call soup_join(soup, corner)
      call check_equal(error, soup%branch%n, 1, "sides of three")
   end subroutine test_branch

   pure subroutine triangles(corner)
      real(wp), intent(out) :: corner(:, :, :)
      integer :: f

      do f = 1, size(face, 2)
         corner(:, :, f) = place(:, face(:, f))
      end do
   end subroutine triangles

   !> A facet of a text.
   pure function loop(a, b, c) result(text)
      character(len=*), intent(in) :: a, b, c
      character(len=71 + len(a) + len(b) + len(c)) :: text

      text = "facet normal 0 0 1" // new_line // "Outer Loop" // new_line // "vertex " // a // &
         new_line // "vertex " // b // new_line // "vertex " // c // new_line // "endloop" // &
         new_line // "endfacet" // new_line
   end function loop

end module test_stl
