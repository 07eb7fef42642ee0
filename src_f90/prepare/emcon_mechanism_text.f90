!> Rigid motions that nothing prevents: what makes a static problem singular.
module emcon_mechanism_text
   use emcon_bodies, only : bodies_find
   use emcon_errors, only : error_t
   use emcon_free_motions, only : find_assemblies, find_free_motions
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_null_space
   use emcon_mechanisms, only : held_places, mechanisms_find, mechanisms_t, &
      mechanism_places, rigid_motions_as_one
   use emcon_mechanism_rows, only : mechanism_rows_find, mechanism_rows_t
   use emcon_scene, only : scene_t
   use emcon_steps, only : prescribed_t
   use emcon_system, only : system_t
   use emcon_text, only : joined, string_t, to_text
   implicit none
   private
   public :: free_motion_text, describe_motion

   !> Bodies of an assembly that are named.
   integer, parameter :: most_named = 10
   !> What turns by less than this part of its way over its size slides, on a surface that is bent.
   real(dp), parameter :: slides = 0.1_dp

contains

   !> Names the first body that can move as a rigid one, and how, or the first assembly of bodies
   !> tied to each other; empty if none can. Bodies in a contact pair are looked at only
   !> `with_contact`: contact may hold them. `system%space%linear` holds the rows of the step.
   !> A body that has turned is held by its supports as it lies now, with NLGEOM.
   subroutine free_motion_text(system, scene, prescribed, text, with_contact, is_held, u)
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      type(prescribed_t), intent(in) :: prescribed(:)
      character(len=:), allocatable, intent(out) :: text
      logical, intent(in), optional :: with_contact
      logical, intent(in), optional :: is_held(:)        !! (n_body) by something else
      real(wp), intent(in), optional :: u(:, :)          !! (n_dim, n_node) [L]; absent: at rest
      type(mechanisms_t) :: bodies
      real(wp) :: x(size(scene%x, 1), size(scene%x, 2))
      type(mechanism_rows_t) :: rows
      integer, allocatable :: assembly(:), order(:), member(:)
      real(dp), allocatable :: z(:, :)
      real(dp) :: noise
      logical :: contact_holds
      integer :: n_assembly, i, n, first, last

      text = ""
      contact_holds = .true.
      if (present(with_contact)) contact_holds = .not. with_contact
      x = scene%x
      if (present(u)) x = held_places(system, scene, u)
      call mechanism_rows_find(system, prescribed, rows)
      call mechanisms_find(system, scene, x, rows, contact_holds, &
         contact_holds .or. present(is_held), bodies)
      if (present(is_held)) then
         do n = 1, size(is_held)
            if (is_held(n)) bodies%is_free(:, n) = .false.
         end do
      end if
      call find_assemblies(bodies, rows, assembly, n_assembly, order)
      text = ""
      last = 0
      do i = 1, n_assembly
         first = last + 1
         do while (last < size(order))
            if (assembly(rows%low(order(last + 1))) /= i) exit
            last = last + 1
         end do
         member = pack([(n, n = 1, bodies%n)], assembly == i)
         call find_free_motions(bodies, rows, order(first:last), member, z, noise)
         if (size(z, 2) == 0) cycle
         call describe_motion(bodies, system, scene, noise, member, z, text)
         return
      end do
   end subroutine free_motion_text

   !> "the body of element 3 is free to rotate": of an assembly, the bodies that move together with
   !> the first one that can, and how.
   subroutine describe_motion(bodies, system, scene, noise, member, z, text)
      type(mechanisms_t), intent(in) :: bodies
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      real(dp), intent(in) :: noise                      !! size of the round-off in `z`
      integer, allocatable, intent(inout) :: member(:)   !! bodies; on return those named
      real(dp), allocatable, intent(inout) :: z(:, :)    !! (n_motion*members, n) likewise
      character(len=:), allocatable, intent(out) :: text
      character(len=:), allocatable :: name, motion

      call keep_moving_together(bodies, member, z, sqrt(noise))
      call name_text(bodies, system, scene, member, name)
      call motion_text(bodies, member, z, sqrt(noise), motion)
      text = name // " free to " // motion
   end subroutine describe_motion

   !> Of an assembly keep the first body that moves and those that move with it: whose motions
   !> are correlated over the null space.
   subroutine keep_moving_together(bodies, member, z, tol)
      type(mechanisms_t), intent(in) :: bodies
      integer, allocatable, intent(inout) :: member(:)
      real(dp), allocatable, intent(inout) :: z(:, :)    !! (n_motion*members, n) orthonormal
      real(dp), intent(in) :: tol                        !! what counts as motion
      real(dp) :: size_of(size(member)), block(bodies%n_motion, bodies%n_motion)
      integer, allocatable :: link(:, :), group(:)
      integer :: i, j, n, n_group, pass

      do i = 1, size(member)
         size_of(i) = norm2(z(mechanism_places(bodies, i), :))
      end do
      if (maxval(size_of) <= tol) return         ! coordinates that are mostly round-off
      do pass = 1, 2                             ! count, then list
         n = 0
         do i = 1, size(member)
            if (size_of(i) <= tol) cycle
            do j = i, size(member)
               if (size_of(j) <= tol) cycle
               block = matmul(z(mechanism_places(bodies, i), :), &
                  transpose(z(mechanism_places(bodies, j), :)))
               if (maxval(abs(block)) <= tol*size_of(i)*size_of(j)) cycle
               n = n + 1
               if (pass == 2) link(:, n) = [i, j]
            end do
         end do
         if (pass == 1) allocate(link(2, n))
      end do
      call bodies_find(link, size(member), group, n_group)
      z = z(pack([(i, i = 1, size(z, 1))], [((group(j) == 1, i = 1, bodies%n_motion), &
         j = 1, size(group))]), :)
      member = pack(member, group == 1)
   end subroutine keep_moving_together

   !> "the body of element 3 is", or all bodies and nodes of `member`. A body without elements is
   !> named by its first node.
   subroutine name_text(bodies, system, scene, member, text)
      type(mechanisms_t), intent(in) :: bodies
      type(system_t), intent(in) :: system
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: member(:)
      character(len=:), allocatable, intent(out) :: text
      integer :: label(bodies%n), i
      logical :: has_element(bodies%n)

      has_element = .false.
      do i = size(bodies%of_node), 1, -1
         if (bodies%of_node(i) > 0) label(bodies%of_node(i)) = scene%node%label(i)
      end do
      do i = size(scene%element%label), 1, -1
         associate (b => system%space%body(scene%element%node(1, i)))
            label(b) = scene%element%label(i)
            has_element(b) = .true.
         end associate
      end do
      text = ""
      call add("the body of element ", "the bodies of elements ", has_element(member))
      call add("the body of node ", "the bodies of nodes ", member <= bodies%n_mesh .and. &
         bodies%size(member) > 0.0_wp .and. .not. has_element(member))
      call add("node ", "nodes ", .not. (bodies%size(member) > 0.0_wp .or. has_element(member)))
      if (size(member) == 1) then
         text = text // " is"
      else
         text = text // ", held together, are"
      end if

   contains

      subroutine add(one, more, is_meant)
         character(len=*), intent(in) :: one, more
         logical, intent(in) :: is_meant(:)      !! (members)
         character(len=:), allocatable :: list

         if (.not. any(is_meant)) return
         if (len(text) > 0) text = text // " and "
         call list_text(one, more, label(pack(member, is_meant)), list)
         text = text // list
      end subroutine add

   end subroutine name_text

   !> `one` or `more` and the labels; empty if there is none.
   pure subroutine list_text(one, more, label, text)
      character(len=*), intent(in) :: one, more
      integer, intent(in) :: label(:)
      character(len=:), allocatable, intent(out) :: text
      type(string_t) :: word(size(label))
      integer :: i

      do i = 1, size(label)
         word(i)%text = to_text(label(i))
      end do
      text = ""
      if (size(label) == 1) text = one // word(1)%text
      if (size(label) > 1) text = more // joined(word, ", ", most_named)
   end subroutine list_text

   !> How bodies that move together can move: as one, which are combinations g of translations and
   !> rotations, or against each other. Nodes follow.
   subroutine motion_text(bodies, member, z, tol, text)
      type(mechanisms_t), intent(in) :: bodies
      integer, intent(in) :: member(:)
      real(dp), intent(in) :: z(:, :)                    !! (n_motion*members, n) their motions
      real(dp), intent(in) :: tol
      character(len=:), allocatable, intent(out) :: text
      type(error_t), allocatable :: error
      real(dp), allocatable :: a(:, :), both(:, :), held(:, :), g(:, :), shift(:, :), &
         direction(:, :), turn(:, :)
      integer :: m, n

      m = bodies%n_motion
      n = count(member <= bodies%n_mesh)
      if (n == 0) n = size(member)
      allocate(a(m*n, m + size(z, 2)))
      a(:, :m) = rigid_motions_as_one(bodies, member(:n))/sqrt(real(n, dp))
      a(:, m + 1:) = -z(:m*n, :)
      text = "move"
      call find_null_space(a, tol, both, error)
      if (allocated(error)) return
      call find_null_space(transpose(both(:m, :)), tol, held, error)     ! g^T held = 0
      if (allocated(error)) return
      call find_null_space(transpose(held), tol, g, error)
      if (allocated(error)) return
      if (size(g, 2) == 1 .and. size(member) == 1) then
         if (norm2(g(bodies%n_dim + 1:, 1))*bodies%size(member(1)) < slides &
            *norm2(g(:bodies%n_dim, 1))) g(bodies%n_dim + 1:, 1) = 0.0_dp
      end if
      call find_null_space(g(bodies%n_dim + 1:, :), tol, shift, error)
      if (allocated(error)) return
      text = ""
      direction = matmul(g(:bodies%n_dim, :), shift)
      call directions_text(direction, size(direction, 2), tol, "move in ", "move along ", text)
      turn = g(bodies%n_dim + 1:, :)
      n = size(g, 2) - size(shift, 2)
      if (n > 0 .and. size(turn, 1) == 1) call join(text, "rotate")
      if (n > 0 .and. size(turn, 1) > 1) call directions_text(turn, n, tol, "rotate about ", &
         "rotate about an axis along ", text)
      if (size(both, 2) < size(z, 2)) call join(text, "move against each other")
   end subroutine motion_text

   !> Add the axes that lie in the space of some directions, and what is left of it: one direction,
   !> or a plane.
   subroutine directions_text(direction, n, tol, axis_word, other_word, text)
      real(dp), intent(in) :: direction(:, :)            !! (n_dim, >= n) that span it
      integer, intent(in) :: n                           !! dimension of that space
      real(dp), intent(in) :: tol
      character(len=*), intent(in) :: axis_word, other_word    !! before the name
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), parameter :: axes = "xyz"
      type(error_t), allocatable :: error
      real(dp), allocatable :: across(:, :), left(:, :)
      integer :: a, m

      if (n == 0) return
      call find_null_space(transpose(direction), tol, across, error)
      if (allocated(error)) return
      left = direction
      m = n
      do a = 1, size(direction, 1)
         if (norm2(across(a, :)) > tol) cycle
         call join(text, axis_word // axes(a:a))
         left(a, :) = 0.0_dp
         m = m - 1
      end do
      if (m == 1) call join(text, other_word &
         // trim(direction_text(left(:, maxloc(sum(left**2, dim=1), 1)), tol)))
      if (m > 1) call join(text, other_word // "any direction across " // &
         trim(direction_text(across(:, 1), tol)))
   end subroutine directions_text

   !> Columns z with a z = 0 up to singular values of `tol`, for a matrix of order one or of noise.
   subroutine find_null_space(a, tol, z, error)
      real(dp), intent(in) :: a(:, :)
      real(dp), intent(in) :: tol
      real(dp), allocatable, intent(out) :: z(:, :)      !! (columns of a, n) orthonormal
      type(error_t), allocatable, intent(out) :: error

      call dense_null_space(a, tol/max(norm2(a), tol), z, error)
   end subroutine find_null_space

   !> "(1, -0.5)": one of the entries is 1.
   pure function direction_text(shift, tol) result(text)
      real(dp), intent(in) :: shift(:)                   !! (n_dim)
      real(dp), intent(in) :: tol                        !! what is less, of the largest, is none
      character(len=64) :: text
      type(string_t) :: word(size(shift))
      integer :: i, k

      i = size(shift)
      do k = size(shift) - 1, 1, -1
         if (abs(shift(k)) > 0.5_dp*abs(shift(i))) i = k
      end do
      do k = 1, size(shift)
         word(k)%text = to_text(real(merge(shift(k)/shift(i), 0.0_dp, &
            abs(shift(k)) > tol*abs(shift(i))), wp), 3)
      end do
      text = "(" // joined(word, ", ", size(word)) // ")"
   end function direction_text

   !> Add `more` to a list of motions.
   pure subroutine join(text, more)
      character(len=:), allocatable, intent(inout) :: text
      character(len=*), intent(in) :: more

      if (len(text) > 0) text = text // ", "
      text = text // more
   end subroutine join

end module emcon_mechanism_text
