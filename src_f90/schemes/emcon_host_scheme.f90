!> Schemes of time integration that a program gives, by the names that decks call them.
module emcon_host_scheme
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_pose, only : instant_t, pose_t
   use emcon_scheme, only : scheme_t
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_scheme_t, host_scheme_add, host_scheme_find, host_scheme_check

   !> What is the inverse of another number is so but for this.
   real(wp), parameter :: rounding = 4.0_wp*epsilon(1.0_wp)

   type :: host_scheme_t
      character(len=:), allocatable :: name      !! capital letters, without blanks
      class(scheme_t), allocatable :: scheme
   end type host_scheme_t

contains

   !> Append a copy of `scheme`.
   subroutine host_scheme_add(list, name, scheme)
      type(host_scheme_t), allocatable, intent(inout) :: list(:)   !! (any) or not allocated
      character(len=*), intent(in) :: name       !! capital letters, without blanks
      class(scheme_t), intent(in) :: scheme
      type(host_scheme_t), allocatable :: longer(:)
      integer :: i, n

      n = 0
      if (allocated(list)) n = size(list)
      allocate(longer(n + 1))
      do i = 1, n
         longer(i)%name = list(i)%name
         call move_alloc(list(i)%scheme, longer(i)%scheme)
      end do
      longer(n + 1)%name = name
      allocate(longer(n + 1)%scheme, source=scheme)
      call move_alloc(longer, list)
   end subroutine host_scheme_add

   !> The place of the scheme `name` in `list`; 0: it was not given.
   pure integer function host_scheme_find(list, name) result(k)
      type(host_scheme_t), allocatable, intent(in) :: list(:)   !! (any) or not allocated
      character(len=*), intent(in) :: name       !! capital letters, without blanks

      if (allocated(list)) then
         do k = 1, size(list)
            if (list(k)%name == name) return
         end do
      end if
      k = 0
   end function host_scheme_find

   !> Are the weights and places of `scheme` ones, as seen for one step of size 1?
   subroutine host_scheme_check(name, scheme, error)
      character(len=*), intent(in) :: name       !! for the message
      class(scheme_t), intent(in) :: scheme
      type(error_t), allocatable, intent(out) :: error
      type(pose_t) :: pose

      pose = scheme%pose(instant_t(), 1.0_wp)
      if (.not. (pose%mass_scale > 0.0_wp .and. pose%mass_scale <= huge(1.0_wp))) then
         call refuse("mass_scale", pose%mass_scale, "must be positive")
      else if (.not. (pose%rate > 0.0_wp .and. pose%rate <= huge(1.0_wp))) then
         call refuse("rate", pose%rate, "must be positive")
      else if (.not. abs(pose%rate*pose%lapse - 1.0_wp) <= rounding) then
         call refuse("lapse", pose%lapse, "must be 1/rate")
      else if (.not. ieee_is_finite(pose%v_weight)) then
         call refuse("v_weight", pose%v_weight, "is not finite")
      else if (.not. (pose%place > 0.0_wp .and. pose%place <= 1.0_wp)) then
         call refuse("place", pose%place, "must be above 0 and at most 1")
      else if (.not. (pose%load_place >= 0.0_wp .and. pose%load_place <= 1.0_wp)) then
         call refuse("load_place", pose%load_place, "must be 0 to 1")
      end if

   contains

      subroutine refuse(what, value, fault)
         character(len=*), intent(in) :: what, fault
         real(wp), intent(in) :: value

         call raise(error, err_input, "the scheme " // name // ": " // what // " = " // &
            to_text(value) // " " // fault // ", in a step of size 1")
      end subroutine refuse

   end subroutine host_scheme_check

end module emcon_host_scheme
