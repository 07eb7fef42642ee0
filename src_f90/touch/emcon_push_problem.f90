!> Gaps without friction: pushes lam >= 0 with g = b + W lam >= 0 and lam.g = 0, where W may be
!> singular: rows may follow from others, as of aligned bodies in a stack.
!>
!> The least motion that closes no gap, by its dual: the deepest gap is pushed open while those
!> that push stay closed; what would come to pull is let go, also in favour of a row that follows
!> from it. So those that push never depend on each other, and each push that is added does work.
!> It begins with those of a start that push without closing anything, as in a step whose contacts
!> are nearly those of the iterate before. With a symmetric W the method ends; over a step rows and
!> columns of W are gradients at its end and discrete ones, and differ a little. Source: Goldfarb
!> and Idnani, Math. Program. 27 (1983) 1-33.
module emcon_push_problem
   use emcon_kinds, only : wp
   implicit none
   private
   public :: push_problem_solve

   !> Of what is less than this part of a row left of it, it follows from others.
   real(wp), parameter :: dependent = 1.0e5_wp*epsilon(1.0_wp)
   !> The same of a start, which does without what nearly follows from others.
   real(wp), parameter :: nearly_dependent = sqrt(epsilon(1.0_wp))
   !> A gap is open where it is below 0 by no more than so much of its terms.
   real(wp), parameter :: closed = 64.0_wp*epsilon(1.0_wp)
   !> Steps per contact at most, corrections of round-off after each, and steps without work after
   !> which what is taken for round-off doubles.
   integer, parameter :: most_steps = 30, n_refine = 2, most_idle = 10

   !> Those that push.
   type :: pushing_t
      integer :: n = 0
      integer, allocatable :: row(:)             !! (>= n) in the order in which they came
      real(wp), allocatable :: inverse(:, :)     !! (>= n, >= n) of their part of W [M/T^2]
      real(wp), allocatable :: push(:)           !! (>= n) [M L/T^2]
   end type pushing_t

contains

   !> Solve for `push`. Not solved: no motion keeps all gaps open, or round-off has no end.
   pure subroutine push_problem_solve(w, free, push, is_solved, n_step)
      real(wp), intent(in) :: w(:, :)            !! (n, n) none of whose x.W x is below 0 [T^2/M]
      real(wp), intent(in) :: free(:)            !! (n) gaps without pushes, b [L]
      !> (n) lam; in: those that push are tried first, out: the solution [M L/T^2]
      real(wp), intent(inout) :: push(:)
      logical, intent(out) :: is_solved          !! else `push` is 0
      integer, intent(out) :: n_step             !! pushes that were added or taken away
      type(pushing_t) :: set
      real(wp) :: gap(size(free)), room(size(free)), work, least
      integer :: p, n_idle

      allocate(set%row(size(free)), set%push(size(free)), set%inverse(size(free), size(free)))
      call begin(w, free, push, set)
      call measure(w, free, set, gap, room)
      is_solved = .false.
      n_step = 0
      n_idle = 0
      least = huge(least)
      push = 0.0_wp
      do
         p = minloc(gap + room, 1)
         if (.not. gap(p) < -room(p)) exit
         if (any(set%row(:set%n) == p) .or. n_step > most_steps*size(free)) return
         call open(w, p, -gap(p), set, n_step)
         if (set%n == 0) return
         call measure(w, free, set, gap, room)
         ! Rows that nearly follow from others may take turns for ever, at no work that can be seen.
         work = dot_product(free(set%row(:set%n)), set%push(:set%n))
         if (.not. work < least) n_idle = n_idle + 1
         least = min(least, work)
         room = room*2.0_wp**(n_idle/most_idle)
      end do
      is_solved = .true.
      push(set%row(:set%n)) = set%push(:set%n)
   end subroutine push_problem_solve

   !> Of those that push at the start the ones that do not follow from others, by what closes their
   !> gaps; what would pull is let go, the most first.
   pure subroutine begin(w, free, start, set)
      real(wp), intent(in) :: w(:, :), free(:), start(:)
      type(pushing_t), intent(inout) :: set
      real(wp) :: less(size(free)), left
      real(wp), allocatable :: gap(:)
      integer :: p, j

      do p = 1, size(free)
         if (.not. start(p) > 0.0_wp) cycle
         call condense(w, p, set, less, left)
         if (left > nearly_dependent*w(p, p)) call take(w, p, 0.0_wp, left, less, set)
      end do
      do while (set%n > 0)
         associate (n => set%n)
            gap = free(set%row(:n))
            set%push(:n) = -matmul(set%inverse(:n, :n), gap)
            j = minloc(set%push(:n), 1)
         end associate
         if (.not. set%push(j) < 0.0_wp) exit
         call let_go(j, set)
      end do
   end subroutine begin

   !> A push of one at contact `p` while those that push stay closed: what these lose by it, and the
   !> part of its own motion that is left.
   pure subroutine condense(w, p, set, less, left)
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: p
      type(pushing_t), intent(in) :: set
      real(wp), intent(inout) :: less(:)         !! (>= n)
      real(wp), intent(out) :: left
      real(wp) :: moved(set%n)

      associate (n => set%n)
         moved = w(set%row(:n), p)
         less(:n) = matmul(set%inverse(:n, :n), moved)
         left = w(p, p) - dot_product(w(p, set%row(:n)), less(:n))
      end associate
      if (.not. left > dependent*w(p, p)) left = 0.0_wp
   end subroutine condense

   !> Push at contact `p` until it is open; what comes to pull on the way is let go. Where nothing
   !> can open it none is left.
   pure subroutine open(w, p, depth, set, n_step)
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: p
      real(wp), intent(in) :: depth              !! of its gap as it begins, > 0 [L]
      type(pushing_t), intent(inout) :: set
      integer, intent(inout) :: n_step
      real(wp) :: less(size(w, 1)), left, rest, push, way
      integer :: j, first

      rest = depth
      push = 0.0_wp
      do
         n_step = n_step + 1
         call condense(w, p, set, less, left)
         associate (n => set%n)
            way = huge(way)
            if (left > 0.0_wp) way = rest/left
            first = 0
            do j = 1, n
               if (.not. less(j) > epsilon(way)*maxval(abs(less(:n)))) cycle
               if (set%push(j)/less(j) >= way) cycle
               way = set%push(j)/less(j)
               first = j
            end do
            if (.not. way < huge(way)) then
               n = 0
               return
            end if
            set%push(:n) = set%push(:n) - way*less(:n)
         end associate
         push = push + way
         rest = rest - way*left
         if (first == 0) exit
         call let_go(first, set)
      end do
      call take(w, p, push, left, less, set)
   end subroutine open

   !> Add contact `p` with its push: `less` is what others lose by one, `left` what it moves.
   pure subroutine take(w, p, push, left, less, set)
      real(wp), intent(in) :: w(:, :)
      integer, intent(in) :: p
      real(wp), intent(in) :: push, left, less(:)
      type(pushing_t), intent(inout) :: set
      real(wp) :: back(set%n), moved(set%n)
      integer :: j

      associate (n => set%n, k => set%inverse)
         moved = w(p, set%row(:n))
         back = matmul(moved, k(:n, :n))
         do j = 1, n
            k(:n, j) = k(:n, j) + less(:n)*(back(j)/left)
         end do
         k(:n, n + 1) = -less(:n)/left
         k(n + 1, :n) = -back/left
         k(n + 1, n + 1) = 1.0_wp/left
         set%row(n + 1) = p
         set%push(n + 1) = push
      end associate
      set%n = set%n + 1
   end subroutine take

   !> Take the `j`th away.
   pure subroutine let_go(j, set)
      integer, intent(in) :: j
      type(pushing_t), intent(inout) :: set
      real(wp) :: column(set%n), line(set%n)
      integer :: i, to

      associate (n => set%n, k => set%inverse)
         column = k(:n, j)
         line = k(j, :n)/k(j, j)
         to = 0
         do i = 1, n
            if (i == j) cycle
            to = to + 1
            k(:j - 1, to) = k(:j - 1, i) - column(:j - 1)*line(i)
            k(j:n - 1, to) = k(j + 1:n, i) - column(j + 1:)*line(i)
            set%row(to) = set%row(i)
            set%push(to) = set%push(i)
         end do
      end associate
      set%n = set%n - 1
   end subroutine let_go

   !> Gaps with the pushes, whose round-off is taken out first, and what of them is round-off.
   pure subroutine measure(w, free, set, gap, room)
      real(wp), intent(in) :: w(:, :), free(:)
      type(pushing_t), intent(inout) :: set
      real(wp), intent(out) :: gap(:), room(:)
      real(wp) :: left(set%n)
      integer :: j, k

      associate (n => set%n, row => set%row(:set%n))
         do k = 1, n_refine
            left = free(row)
            do j = 1, n
               left = left + set%push(j)*w(row, row(j))
            end do
            set%push(:n) = max(0.0_wp, set%push(:n) - matmul(set%inverse(:n, :n), left))
         end do
         gap = free
         room = abs(free)
         do j = 1, n
            gap = gap + set%push(j)*w(:, row(j))
            room = room + set%push(j)*abs(w(:, row(j)))
         end do
         room = closed*room
         gap(row) = max(gap(row), -room(row))
      end associate
   end subroutine measure

end module emcon_push_problem
