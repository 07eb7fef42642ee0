!> What a host code may hand over wrongly, in words: which argument, which entry, which value.
module emcon_interface_check
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite, ieee_is_nan
   use emcon_errors, only : err_input, error_t, raise
   use emcon_interactions, only : contact_options_t, formulation_mortar, formulation_nts, &
      integration_elements, integration_segments, multiplier_dual, multiplier_standard, &
      normal_edge, normal_nodal, smoothing_hermite, smoothing_none
   use emcon_kinds, only : wp
   use emcon_scene, only : scene_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: refuse, check_field, check_list, check_number, check_edges, check_choice, &
      check_options, check_surfaces, check_pairs, name_place

   !> Gauss points at most, as in a deck.
   integer, parameter :: most_points = 10
   character(len=*), parameter :: no_deck = "(no deck): ", no_deck_error = no_deck // "error: "

contains

   !> The error "`place`: `text`".
   pure subroutine refuse(error, place, text)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in) :: place      !! the procedure
      character(len=*), intent(in) :: text

      call raise(error, err_input, place // ": " // text)
   end subroutine refuse

   !> A field over the nodes: its shape, and finite numbers.
   pure subroutine check_field(error, place, name, field, n_node)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place, name
      real(wp), intent(in) :: field(:, :)
      integer, intent(in) :: n_node              !! < 0: any
      character(len=:), allocatable :: needed
      integer :: a, i

      if (allocated(error)) return
      if (size(field, 1) /= 2 .or. (size(field, 2) /= n_node .and. n_node >= 0)) then
         needed = "n_node"
         if (n_node >= 0) needed = to_text(n_node)
         call refuse(error, place, name // " has the shape (" // to_text(size(field, 1)) // ", " &
            // to_text(size(field, 2)) // "), not (2, " // needed // ")")
         return
      end if
      do i = 1, size(field, 2)
         do a = 1, 2
            if (ieee_is_finite(field(a, i))) cycle
            call refuse(error, place, name // "(" // to_text(a) // ", " // to_text(i) // ") is " &
               // number_text(field(a, i)) // ", not a finite number")
            return
         end do
      end do

   end subroutine check_field

   !> A list of finite numbers, `n` of them.
   pure subroutine check_list(error, place, name, list, n)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place, name
      real(wp), intent(in) :: list(:)
      integer, intent(in) :: n
      integer :: i

      if (allocated(error)) return
      if (size(list) /= n) then
         call refuse(error, place, name // " has " // to_text(size(list)) // " entries, not " // &
            to_text(n))
         return
      end if
      do i = 1, n
         if (ieee_is_finite(list(i))) cycle
         call refuse(error, place, name // "(" // to_text(i) // ") is " // number_text(list(i)) // &
            ", not a finite number")
         return
      end do
   end subroutine check_list

   !> Edges of a surface: existing nodes, and a length.
   pure subroutine check_edges(error, place, edge, x)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place
      integer, intent(in) :: edge(:, :)
      real(wp), intent(in) :: x(:, :)            !! (2, n_node)
      integer :: k, i

      if (allocated(error)) return
      if (size(edge, 1) /= 2 .or. size(edge, 2) == 0) then
         call refuse(error, place, "edge has the shape (" // to_text(size(edge, 1)) // ", " // &
            to_text(size(edge, 2)) // "), not (2, n_edge) with n_edge > 0")
         return
      end if
      do i = 1, size(edge, 2)
         do k = 1, 2
            if (edge(k, i) >= 1 .and. edge(k, i) <= size(x, 2)) cycle
            call refuse(error, place, "edge(" // to_text(k) // ", " // to_text(i) // ") is " // &
               to_text(edge(k, i)) // ", not a node in 1.." // to_text(size(x, 2)))
            return
         end do
         associate (a => x(:, edge(1, i)), b => x(:, edge(2, i)))
            if (any(a < b .or. a > b)) cycle
         end associate
         call refuse(error, place, "edge(:, " // to_text(i) // ") = " // to_text(edge(1, i)) // &
            ", " // to_text(edge(2, i)) // " has no length")
         return
      end do
   end subroutine check_edges

   !> A choice, or a number, in `least`..`most`.
   pure subroutine check_choice(error, place, name, value, least, most)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place, name
      integer, intent(in) :: value, least, most

      if (allocated(error)) return
      if (value < least .or. value > most) call refuse(error, place, name // " is " // &
         to_text(value) // ", not in " // to_text(least) // ".." // to_text(most))
   end subroutine check_choice

   !> Formulation and options of a pair.
   pure subroutine check_options(error, place, formulation, options)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place
      integer, intent(in) :: formulation
      type(contact_options_t), intent(in) :: options
      integer :: least

      call check_choice(error, place, "formulation", formulation, formulation_nts, &
         formulation_mortar)
      call check_choice(error, place, "options%integration", options%integration, &
         integration_segments, integration_elements)
      call check_choice(error, place, "options%multiplier", options%multiplier, &
         multiplier_standard, multiplier_dual)
      call check_choice(error, place, "options%normal", options%normal, normal_edge, normal_nodal)
      call check_choice(error, place, "options%smoothing", options%smoothing, smoothing_none, &
         smoothing_hermite)
      least = 1
      if (options%integration == integration_segments) least = 2
      if (options%n_point /= 0) call check_choice(error, place, "options%n_point", &
         options%n_point, least, most_points)
      call check_angle(error, place, "options%normal_angle", options%normal_angle)
      call check_angle(error, place, "options%smoothing_angle", options%smoothing_angle)
   end subroutine check_options

   pure subroutine check_angle(error, place, name, angle)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place, name
      real(wp), intent(in) :: angle

      call check_number(error, place, name, angle)
      if (allocated(error)) return
      if (angle < 0.0_wp .or. angle > 180.0_wp) call refuse(error, place, name // " is " // &
         to_text(angle) // ", not in 0..180 degrees")
   end subroutine check_angle

   !> A finite number.
   pure subroutine check_number(error, place, name, value)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place, name
      real(wp), intent(in) :: value

      if (allocated(error) .or. ieee_is_finite(value)) return
      call refuse(error, place, name // " is " // number_text(value) // ", not a finite number")
   end subroutine check_number

   !> A number that may not be one.
   pure function number_text(value) result(text)
      real(wp), intent(in) :: value
      character(len=number_length(value)) :: text

      if (ieee_is_nan(value)) then
         text = "NaN"
      else if (ieee_is_finite(value)) then
         text = to_text(value)
      else
         text = "infinite"
      end if
   end function number_text

   pure integer function number_length(value) result(n)
      real(wp), intent(in) :: value

      if (ieee_is_nan(value)) then
         n = len("NaN")
      else if (ieee_is_finite(value)) then
         n = len(to_text(value))
      else
         n = len("infinite")
      end if
   end function number_length

   !> Both surfaces exist.
   pure subroutine check_surfaces(error, place, n_surface, slave, master)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place
      integer, intent(in) :: n_surface, slave, master

      if (allocated(error)) return
      if (n_surface == 0) then
         call refuse(error, place, "there is no surface yet")
         return
      end if
      call check_choice(error, place, "slave", slave, 1, n_surface)
      call check_choice(error, place, "master", master, 1, n_surface)
   end subroutine check_surfaces

   !> The two surfaces of a pair share no node.
   subroutine check_pairs(error, place, scene)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_slave(:)
      integer :: i, k, side

      if (allocated(error)) return
      allocate(is_slave(size(scene%x, 2)))
      do i = 1, size(scene%pair)
         associate (pair => scene%pair(i), surface => scene%surface)
            if (pair%slave == pair%master) cycle
            is_slave = .false.
            is_slave(surface(pair%slave)%edge(1, :)) = .true.
            is_slave(surface(pair%slave)%edge(2, :)) = .true.
            do k = 1, size(surface(pair%master)%edge, 2)
               do side = 1, 2
                  if (.not. is_slave(surface(pair%master)%edge(side, k))) cycle
                  call refuse(error, place, "slave surface " // surface(pair%slave)%name // &
                     " and master surface " // surface(pair%master)%name // " of a pair share " &
                     // "node " // to_text(scene%node_label(surface(pair%master)%edge(side, k))))
                  return
               end do
            end do
         end associate
      end do
   end subroutine check_pairs

   !> Say which procedure an error of a lower layer comes from, in place of a line of a deck.
   pure subroutine name_place(error, place)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in) :: place

      if (.not. allocated(error)) return
      if (index(error%message, no_deck_error) == 1) then
         error%message = error%message(len(no_deck_error) + 1:)
      else if (index(error%message, no_deck) == 1) then
         error%message = error%message(len(no_deck) + 1:)
      end if
      error%message = place // ": " // error%message
   end subroutine name_place

end module emcon_interface_check
