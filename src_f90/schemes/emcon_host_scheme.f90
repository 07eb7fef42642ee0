!> Schemes of time integration that a program gives, by the names that decks call them.
module emcon_host_scheme
   use, intrinsic :: ieee_arithmetic, only : ieee_is_finite
   use emcon_errors, only : err_input, error_t, raise
   use emcon_evaluation, only : evaluation_conserves, evaluation_contact_conserves, evaluation_t, &
      instant_t, most_past
   use emcon_kinds, only : wp
   use emcon_scheme, only : scheme_row_t, scheme_t
   use emcon_scheme_registry, only : scheme_user_row
   use emcon_text, only : to_text
   implicit none
   private
   public :: host_scheme_t, host_scheme_add, host_scheme_find, host_scheme_check, host_scheme_row

   !> What is the inverse of another number is so but for this.
   real(wp), parameter :: rounding = 4.0_wp*epsilon(1.0_wp)
   !> Sizes of the step before for which poses are looked at: there is none, and one as long.
   real(wp), parameter :: before(*) = [0.0_wp, 1.0_wp]

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

   !> The row of `scheme`: what it keeps it says itself, what it does not go with follows from
   !> where it evaluates forces.
   pure type(scheme_row_t) function host_scheme_row(name, scheme) result(row)
      character(len=*), intent(in) :: name       !! capital letters, without blanks
      class(scheme_t), intent(in) :: scheme      !! that was checked
      type(evaluation_t) :: evaluation
      integer :: k

      row = scheme_user_row
      row%word = name
      row%n_past = scheme%row%n_past
      row%is_accelerated = scheme%row%is_accelerated
      row%setting = scheme%row%setting
      do k = 1, size(before)
         evaluation = scheme%evaluation(instant_t(h_before=before(k)), 1.0_wp)
         row%dissipates = row%dissipates .or. evaluation%dissipation > 0.0_wp
         row%takes_jumps = row%takes_jumps .and. evaluation_contact_conserves(evaluation)
         row%takes_massless = row%takes_massless .and. evaluation_conserves(evaluation)
      end do
      row%takes_damping = row%takes_damping .and. row%takes_jumps
   end function host_scheme_row

   !> Are the weights and places of `scheme` ones, as seen for a first step of size 1 and one that
   !> follows another of that size?
   subroutine host_scheme_check(name, scheme, error)
      character(len=*), intent(in) :: name       !! for the message
      class(scheme_t), intent(in) :: scheme
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      if (scheme%row%n_past < 0 .or. scheme%row%n_past > most_past) call raise(error, err_input, &
         "the scheme " // name // ": row%n_past = " // to_text(scheme%row%n_past) // " must be " &
         // "0 to " // to_text(most_past))
      if (scheme%row%is_accelerated .and. scheme%row%n_past < 1 .and. .not. allocated(error)) call &
         raise(error, err_input, "the scheme " // name // ": row%is_accelerated needs " // &
         "row%n_past = 1 or more, to keep the acceleration")
      if (scheme%row%is_explicit .and. .not. allocated(error)) call raise(error, err_input, &
         "the scheme " // name // ": row%is_explicit is for schemes of EMCON alone")
      do k = 1, size(before)
         if (allocated(error)) return
         call check_pose(name, scheme%evaluation(instant_t(h_before=before(k)), 1.0_wp), &
            scheme%row%n_past, error)
      end do
   end subroutine host_scheme_check

   !> Are these weights and places, of a step of size 1?
   subroutine check_pose(name, evaluation, n_past, error)
      character(len=*), intent(in) :: name       !! for the message
      type(evaluation_t), intent(in) :: evaluation
      integer, intent(in) :: n_past              !! fields that the scheme keeps
      type(error_t), allocatable, intent(out) :: error

      if (.not. (evaluation%mass_scale > 0.0_wp .and. evaluation%mass_scale <= huge(1.0_wp))) then
         call refuse("mass_scale", evaluation%mass_scale, "must be positive")
      else if (.not. (evaluation%rate > 0.0_wp .and. evaluation%rate <= huge(1.0_wp))) then
         call refuse("rate", evaluation%rate, "must be positive")
      else if (.not. abs(evaluation%rate*evaluation%lapse - 1.0_wp) <= rounding) then
         call refuse("lapse", evaluation%lapse, "must be 1/rate")
      else if (.not. ieee_is_finite(evaluation%v_weight)) then
         call refuse("v_weight", evaluation%v_weight, "is not finite")
      else if (.not. (evaluation%at > 0.0_wp .and. evaluation%at <= 1.0_wp)) then
         call refuse("at", evaluation%at, "must be above 0 and at most 1")
      else if (.not. (evaluation%load_place >= 0.0_wp .and. evaluation%load_place <= 1.0_wp)) then
         call refuse("load_place", evaluation%load_place, "must be 0 to 1")
      else if (.not. (evaluation%start_weight >= 0.0_wp &
         .and. evaluation%start_weight <= huge(1.0_wp))) then
         call refuse("start_weight", evaluation%start_weight, "must be 0 or more")
      else if (.not. (evaluation%dissipation >= 0.0_wp .and. evaluation%dissipation <= 1.0_wp)) then
         call refuse("dissipation", evaluation%dissipation, "must be 0 to 1")
      else if (.not. (evaluation%recalled >= 0.0_wp .and. evaluation%recalled <= 1.0_wp)) then
         call refuse("recalled", evaluation%recalled, "must be 0 to 1")
      else if (evaluation%recalled > 0.0_wp .and. n_past < 1) then
         call refuse("recalled", evaluation%recalled, "needs row%n_past = 1 or more")
      end if
      if (.not. allocated(error)) call check_past("past_velocity", evaluation%past_velocity)
      if (.not. allocated(error)) call check_past("past_change", evaluation%past_change)

   contains

      subroutine refuse(what, value, fault)
         character(len=*), intent(in) :: what, fault
         real(wp), intent(in) :: value

         call raise(error, err_input, "the scheme " // name // ": " // what // " = " // &
            to_text(value) // " " // fault // ", in a step of size 1")
      end subroutine refuse

      !> Weights of the past are numbers, and of what is kept.
      subroutine check_past(what, weight)
         character(len=*), intent(in) :: what
         real(wp), intent(in) :: weight(most_past)
         integer :: k

         do k = 1, most_past
            if (.not. ieee_is_finite(weight(k))) then
               call refuse(what // "(" // to_text(k) // ")", weight(k), "is not finite")
               return
            else if (k > n_past .and. abs(weight(k)) > 0.0_wp) then
               call refuse(what // "(" // to_text(k) // ")", weight(k), "needs row%n_past = " // &
                  to_text(k) // " or more")
               return
            end if
         end do
      end subroutine check_past

   end subroutine check_pose

end module emcon_host_scheme
