!> Contact before the first step: adjustment, orientation, penetration.
module emcon_initial_contact
   use emcon_contact, only : constraint_t, contact_t, gap_state_t
   use emcon_errors, only : err_input, error_t, raise
   use emcon_kinds, only : wp
   use emcon_nts, only : nts_init, nts_nearest, nts_t
   use emcon_scene, only : contact_pair_t, scene_t, where_text
   use emcon_sort, only : find_sorted
   use emcon_text, only : joined, note_add, notes_t, string_t, to_text
   implicit none
   private
   public :: initial_contact_prepare

   !> Slave nodes looked at to see on which side of the master surface they are.
   integer, parameter :: most_samples = 64
   !> Iterations that put a node onto the surface.
   integer, parameter :: most_moves = 10
   !> Nodes named in a message.
   integer, parameter :: most_named = 10
   !> Coordinates in a deck are rounded: so many epsilons of them are no penetration.
   real(wp), parameter :: rounding = 8.0_wp*epsilon(1.0_wp)

contains

   !> Move the nodes that ADJUST= names onto their surface and check every pair; the notes tell
   !> what was done.
   subroutine initial_contact_prepare(scene, notes, error)
      type(scene_t), intent(inout) :: scene
      type(notes_t), intent(inout) :: notes
      type(error_t), allocatable, intent(out) :: error
      type(nts_t) :: contact
      integer :: i

      do i = 1, size(scene%pair)
         call nts_init(contact, scene, scene%pair(i), error)
         if (allocated(error)) return
         call check_sides(scene, scene%pair(i), contact, error)
         if (allocated(error)) return
         call adjust_pair(scene, scene%pair(i), contact, notes)
         call check_penetration(scene, scene%pair(i), contact, error)
         if (allocated(error)) return
      end do
   end subroutine initial_contact_prepare

   !> Slave nodes are all behind the master surface: its normals point away from them.
   subroutine check_sides(scene, pair, contact, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(nts_t), intent(inout) :: contact
      type(error_t), allocatable, intent(out) :: error
      integer :: i, stride, n_over, n_behind
      real(wp) :: gap
      logical :: is_over

      stride = max(1, contact%n_constraint/most_samples)
      n_over = 0
      n_behind = 0
      do i = 1, contact%n_constraint, stride
         call nts_nearest(contact, i, scene%x, scene%u0, gap, is_over)
         if (.not. is_over) cycle
         n_over = n_over + 1
         if (gap < 0.0_wp) n_behind = n_behind + 1
      end do
      if (n_over > 0 .and. n_behind == n_over) then
         call raise(error, err_input, where_text(scene, pair%origin) // ": error: the normals of " &
            // "master surface " // scene%surface(pair%master)%name // " point away from slave " &
            // "surface " // scene%surface(pair%slave)%name // "; check the face labels")
      end if
   end subroutine check_sides

   !> Put the slave nodes within ADJUST= of the surface, and those behind it, onto it, free of
   !> stress: along the normal, in the reference configuration.
   subroutine adjust_pair(scene, pair, contact, notes)
      type(scene_t), intent(inout) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(nts_t), intent(inout) :: contact
      type(notes_t), intent(inout) :: notes
      type(gap_state_t) :: state
      type(constraint_t) :: constraint(1)
      real(wp) :: zero(size(scene%x, 1), size(scene%x, 2)), largest
      logical :: is_meant
      integer :: i, k, n_moved

      if (pair%adjust_distance < 0.0_wp .and. pair%adjust_set == 0) return
      zero = 0.0_wp
      contact%reach = 0.0_wp
      call contact%begin_step(scene%x, scene%u0, zero)
      call contact%measure(scene%x, scene%u0, zero)
      largest = 0.0_wp
      n_moved = 0
      do i = 1, contact%n_constraint
         if (contact%edge(i) == 0) cycle
         state = contact%state(i)
         is_meant = state%gap0 <= pair%adjust_distance
         if (pair%adjust_set > 0) is_meant = &
            find_sorted(scene%node_set(pair%adjust_set)%item, contact%node(i)) > 0
         if (.not. (state%is_over .and. is_meant)) cycle
         largest = max(largest, abs(state%gap0))
         n_moved = n_moved + 1
         do k = 1, most_moves
            call contact%evaluate([i], scene%x, scene%u0, zero, [0.0_wp], constraint)
            associate (normal => constraint(1)%c(:, 1))
               scene%x(:, contact%node(i)) = scene%x(:, contact%node(i)) &
                  - constraint(1)%gap1*normal/dot_product(normal, normal)
            end associate
            if (abs(constraint(1)%gap1) <= epsilon(1.0_wp)*constraint(1)%size) exit
         end do
      end do
      call note_add(notes, where_text(scene, pair%origin) // ": ADJUST moves " // &
         to_text(n_moved) // " slave nodes, by " // to_text(largest) // " at most")
   end subroutine adjust_pair

   !> Slave nodes behind the master surface, with their depths.
   subroutine check_penetration(scene, pair, contact, error)
      type(scene_t), intent(in) :: scene
      type(contact_pair_t), intent(in) :: pair
      type(nts_t), intent(inout) :: contact
      type(error_t), allocatable, intent(out) :: error
      type(gap_state_t) :: state
      type(string_t), allocatable :: found(:)
      real(wp) :: zero(size(scene%x, 1), size(scene%x, 2)), noise, deepest
      integer :: i, n

      zero = 0.0_wp
      noise = rounding*maxval(abs(scene%x))
      contact%reach = 0.0_wp
      call contact%begin_step(scene%x, scene%u0, zero)
      call contact%measure(scene%x, scene%u0, zero)
      allocate(found(contact%n_constraint))
      n = 0
      deepest = 0.0_wp
      do i = 1, contact%n_constraint
         if (contact%edge(i) == 0) cycle
         state = contact%state(i)
         if (.not. state%is_over .or. state%gap0 >= -noise) cycle
         n = n + 1
         deepest = max(deepest, -state%gap0)
         found(n)%text = to_text(scene%node_label(contact%node(i))) // " (" // &
            to_text(-state%gap0) // ")"
      end do
      if (n == 0) return
      call raise(error, err_input, where_text(scene, pair%origin) // ": error: " // to_text(n) // &
         " slave nodes of surface " // scene%surface(pair%slave)%name // " penetrate surface " // &
         scene%surface(pair%master)%name // ", by " // to_text(deepest) // " at most; node " // &
         "(depth): " // joined(found(:n), ", ", most_named) // &
         "; move them, or let *CONTACT PAIR, ADJUST= do it")
   end subroutine check_penetration

end module emcon_initial_contact
