!> Contact with friction of few places in the plane, whose slips and gaps are linear in the forces.
!>
!> [g; -s] = [d; -r] + W [lam; tau], with slips that lead to a: by trials of the law at all places
!> at once, which is Newton's method for it, and where these go round in a circle by the method of
!> Lemke for (lam, tau+, tau-, rest of the cone), whose matrix is copositive: where W is positive
!> definite it ends in a solution for any coefficient. Source: docs/theory.md, eq. (14i).
module emcon_friction_solve_plane
   use emcon_coulomb_law, only : contact_open, contact_rests, contact_slides, contact_sticks, &
      contact_trial_t, coulomb_trial, is_same_status, slip_status_t
   use emcon_kinds, only : dp, wp
   use emcon_lapack, only : dense_solve
   use emcon_lemke, only : lemke_solve
   implicit none
   private
   public :: friction_problem_t, friction_solve

   !> Trials at most before the other method takes over.
   integer, parameter :: most_trials = 30
   !> Forces that differ by less than this part of the largest are one.
   real(wp), parameter :: tied = 5.0e4_wp*epsilon(1.0_wp)

   type :: friction_problem_t
      real(wp), allocatable :: w(:, :)               !! (2 n, 2 n) W [T^2/M]
      real(wp), allocatable :: gap(:), slip(:)       !! (n) d, r: without forces [L]
      real(wp), allocatable :: slip_target(:)        !! (n) a [L]
      real(wp), allocatable :: mu(:)                 !! (n)
   end type friction_problem_t

contains

   !> Forces and statuses that obey the laws. `status` on entry is where trials start from.
   subroutine friction_solve(problem, status, at, is_solved, fell_back)
      type(friction_problem_t), intent(in) :: problem
      type(slip_status_t), intent(inout) :: status(:)    !! (n)
      type(contact_trial_t), intent(out) :: at(:)    !! (n)
      logical, intent(out) :: is_solved              !! by the other method also not: jammed
      logical, intent(out) :: fell_back              !! trials have not come to an end
      integer :: i

      fell_back = .false.
      do i = 1, most_trials
         call solve_in(problem, status, at, is_solved)
         if (.not. is_solved) exit
         call try(problem, status, at, is_solved)
         if (is_solved) return
      end do
      fell_back = .true.
      call solve_by_lemke(problem, status, at, is_solved)
   end subroutine friction_solve

   !> Forces, gaps and slips where the law holds as the statuses say.
   subroutine solve_in(problem, status, at, is_solved)
      type(friction_problem_t), intent(in) :: problem
      type(slip_status_t), intent(in) :: status(:)
      type(contact_trial_t), intent(out) :: at(:)
      logical, intent(out) :: is_solved
      real(dp), dimension(2*size(status), 2*size(status)) :: matrix
      real(dp), dimension(2*size(status), 1) :: b, x
      logical :: is_singular
      integer :: i, n

      n = size(status)
      matrix = real(problem%w, dp)
      b(:, 1) = real([-problem%gap, problem%slip], dp)
      do i = 1, n
         if (status(i)%kind == contact_open) call put(i, 0.0_dp)
         if (status(i)%kind == contact_sticks) b(n + i, 1) = b(n + i, 1) &
            - real(problem%slip_target(i), dp)
         if (any(status(i)%kind == [contact_sticks, contact_rests])) cycle
         call put(n + i, 0.0_dp)
         matrix(n + i, i) = -real(problem%mu(i)*status(i)%direction(1), dp)
      end do
      call dense_solve(matrix, b, x, is_singular)
      is_solved = .not. is_singular
      if (is_solved) call take(problem, real(x(:n, 1), wp), real(x(n + 1:, 1), wp), at)

   contains

      !> Row `k` says that force `k` is `value`.
      subroutine put(k, value)
         integer, intent(in) :: k
         real(dp), intent(in) :: value

         matrix(k, :) = 0.0_dp
         matrix(k, k) = 1.0_dp
         b(k, 1) = value
      end subroutine put

   end subroutine solve_in

   !> What forces lead to.
   pure subroutine take(problem, lam, tau, at)
      type(friction_problem_t), intent(in) :: problem
      real(wp), intent(in) :: lam(:), tau(:)
      type(contact_trial_t), intent(out) :: at(:)
      real(wp), dimension(2*size(lam)) :: force, moved

      force(:size(lam)) = lam
      force(size(lam) + 1:) = tau
      moved = matmul(problem%w, force)
      at%lam = lam
      at%tau(1) = tau
      at%gap = problem%gap + moved(:size(lam))
      at%slip(1) = problem%slip - moved(size(lam) + 1:)
   end subroutine take

   !> The next statuses by a trial at all places; `stands`: they are the same.
   pure subroutine try(problem, status, at, stands)
      type(friction_problem_t), intent(in) :: problem
      type(slip_status_t), intent(inout) :: status(:)
      type(contact_trial_t), intent(in) :: at(:)
      logical, intent(out) :: stands
      type(contact_trial_t) :: place
      type(slip_status_t) :: next
      real(wp) :: stiffness, tie
      integer :: i, n

      n = size(status)
      tie = tied*max(maxval(abs(at%lam)), maxval(abs(at%tau(1))))
      stands = .true.
      do i = 1, n
         place = at(i)
         place%slip_target(1) = problem%slip_target(i)
         stiffness = 2.0_wp/(problem%w(i, i) + problem%w(n + i, n + i))
         if (status(i)%kind /= contact_open) place%gap = 0.0_wp
         if (status(i)%kind == contact_sticks) place%slip = place%slip_target
         if (status(i)%kind == contact_rests) place%slip = 0.0_wp
         next = coulomb_trial(status(i), place, problem%mu(i), stiffness, tie)
         stands = stands .and. is_same_status(next, status(i))
         status(i) = next
      end do
   end subroutine try

   !> By complementary pivoting over (lam, tau+, tau-, mu lam - |tau|), with slips from a: what is
   !> free before that, or rests, is for others to find.
   subroutine solve_by_lemke(problem, status, at, is_solved)
      type(friction_problem_t), intent(in) :: problem
      type(slip_status_t), intent(out) :: status(:)
      type(contact_trial_t), intent(out) :: at(:)
      logical, intent(out) :: is_solved
      real(wp) :: m(4*size(status), 4*size(status)), z(4*size(status)), force, length
      integer :: i, n, n_pivot

      n = size(status)
      ! Forces by the largest stiffness, so that all entries are of one size.
      length = maxval(abs(problem%w))
      force = max(maxval(abs(problem%gap)), maxval(abs(problem%slip)), tiny(force))
      m = 0.0_wp
      associate (w => problem%w/length)
         m(:n, :3*n) = reshape([w(:n, :n), w(:n, n + 1:), -w(:n, n + 1:)], [n, 3*n])
         m(n + 1:2*n, :3*n) = reshape([w(n + 1:, :n), w(n + 1:, n + 1:), -w(n + 1:, n + 1:)], &
            [n, 3*n])
      end associate
      m(2*n + 1:3*n, :3*n) = -m(n + 1:2*n, :3*n)
      do i = 1, n
         m([n + i, 2*n + i], 3*n + i) = 1.0_wp
         m(3*n + i, i) = problem%mu(i)
         m(3*n + i, [n + i, 2*n + i]) = -1.0_wp
      end do
      associate (slip => problem%slip - problem%slip_target)
         call lemke_solve(m, [problem%gap, -slip, slip, 0.0_wp*slip]/force, z, is_solved, n_pivot)
      end associate
      if (.not. is_solved) return
      z = (force/length)*z
      call take(problem, z(:n), z(n + 1:2*n) - z(2*n + 1:3*n), at)
      do i = 1, n
         if (z(3*n + i) > 0.0_wp) status(i) = slip_status_t(contact_slides, &
            [sign(1.0_wp, at(i)%tau(1)), 0.0_wp])
         if (.not. z(i) > 0.0_wp) status(i) = slip_status_t(contact_open)
      end do
   end subroutine solve_by_lemke

end module emcon_friction_solve_plane
