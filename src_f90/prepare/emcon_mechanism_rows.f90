!> Conditions on the motions of rigid bodies, as rows over the degrees of freedom of nodes:
!> prescribed freedoms, linear constraints and the gaps of contact.
module emcon_mechanism_rows
   use emcon_constraint, only : condition_t
   use emcon_kinds, only : dp, wp
   use emcon_steps, only : prescribed_t
   use emcon_system, only : system_t
   implicit none
   private
   public :: mechanism_rows_t, mechanism_rows_find, mechanism_rows_append

   !> Sum of weight times displacement over some degrees of freedom = 0; the weights' sizes sum
   !> up to 1.
   type :: mechanism_rows_t
      integer :: n = 0
      integer, allocatable :: start(:)               !! (n + 1) entries before each row, from 0
      integer, allocatable :: dof(:)                 !! places in an (n_dim, n_node) array
      real(wp), allocatable :: weight(:)
      integer, allocatable :: low(:), high(:)        !! (n) first and last body; 0: none is free
      real(dp) :: noise = 0.0_dp                     !! what prevents less prevents nothing
   end type mechanism_rows_t

   !> A normal that prevents less of a motion than this, per unit of it, does not hold it: normals
   !> are as exact as displacements that Newton's method has converged to.
   real(dp), parameter :: contact_noise = sqrt(epsilon(1.0_dp))

contains

   !> Prescribed freedoms, then linear constraints.
   subroutine mechanism_rows_find(system, prescribed, rows)
      type(system_t), intent(in) :: system
      type(prescribed_t), intent(in) :: prescribed(:)
      type(mechanism_rows_t), intent(out) :: rows
      real(wp) :: total
      integer :: k, m, n, n_dim, n_linear

      m = size(prescribed)
      n_dim = size(system%space%is_alive, 1)
      n_linear = 0
      if (allocated(system%space%linear%start)) n_linear = system%space%linear%n
      n = m
      if (n_linear > 0) n = m + system%space%linear%start(n_linear + 1)
      rows%n = m + n_linear
      allocate(rows%start(rows%n + 1), rows%dof(n), rows%weight(n))
      rows%start(:m + 1) = [(k, k = 0, m)]
      do k = 1, m
         rows%dof(k) = n_dim*(prescribed(k)%node - 1) + prescribed(k)%dof
         rows%weight(k) = 1.0_wp
      end do
      do k = 1, n_linear
         associate (linear => system%space%linear, from => system%space%linear%start(k) + 1, &
               to => system%space%linear%start(k + 1))
            total = sum(abs(linear%weight(from:to)))
            if (.not. total > 0.0_wp) total = 1.0_wp
            rows%start(m + k + 1) = m + to
            rows%dof(m + from:m + to) = linear%dof(from:to)
            rows%weight(m + from:m + to) = linear%weight(from:to)/total
            if (linear%is_gone(k)) rows%weight(m + from:m + to) = 0.0_wp
         end associate
      end do
   end subroutine mechanism_rows_find

   !> Append the rows of contact: the gradients of gaps at the end, and of what `grips` the surface
   !> also those of slips. What slides in space holds across its way: friction would turn.
   subroutine mechanism_rows_append(rows, item, grips, way)
      type(mechanism_rows_t), intent(inout) :: rows
      type(condition_t), intent(in) :: item(:)
      logical, intent(in) :: grips(:)            !! (size(item)) these rub
      !> (n_dim - 1, size(item)) of length 1: along which of these it slides; 0: it does not
      real(wp), intent(in) :: way(:, :)
      integer :: k, n, m, s, n_dim

      if (size(item) == 0) return
      n_dim = size(item(1)%c, 1)
      rows%noise = contact_noise
      n = rows%start(rows%n + 1)
      m = n_dim*(sum(item%n_node) + (n_dim - 1)*sum(item%n_node, mask=grips))
      rows%dof = [rows%dof, spread(0, 1, m)]
      rows%weight = [rows%weight, spread(0.0_wp, 1, m)]
      do k = 1, size(item)
         call append(item(k), item(k)%c)
         if (.not. grips(k)) cycle
         if (any(abs(way(:, k)) > 0.0_wp)) then
            if (size(way, 1) > 1) call append(item(k), across(item(k), way(:, k)))
            cycle
         end if
         do s = 1, n_dim - 1
            call append(item(k), item(k)%t1(:, :, s))
         end do
      end do

   contains

      !> One row, of the derivatives `part` by the nodes of a condition.
      subroutine append(item, part)
         type(condition_t), intent(in) :: item
         real(wp), intent(in) :: part(:, :)      !! (n_dim, >= n_node)
         real(wp) :: total
         integer :: i, a

         total = sum(abs(part(:, :item%n_node)))
         if (.not. total > 0.0_wp) total = 1.0_wp
         do i = 1, item%n_node
            do a = 1, n_dim
               n = n + 1
               rows%dof(n) = n_dim*(item%node(i) - 1) + a
               rows%weight(n) = part(a, i)/total
            end do
         end do
         rows%n = rows%n + 1
         rows%start = [rows%start, n]
      end subroutine append

   end subroutine mechanism_rows_append

   !> The slip across the way of what slides: of the component that has the least part in it.
   pure function across(item, way) result(part)
      type(condition_t), intent(in) :: item
      real(wp), intent(in) :: way(:)          !! (n_dim - 1) of length 1
      real(wp) :: part(size(item%t1, 1), size(item%t1, 2))
      integer :: s, least

      least = minloc(abs(way), 1)
      part = item%t1(:, :, least)
      do s = 1, size(way)
         part = part - way(least)*way(s)*item%t1(:, :, s)
      end do
   end function across

end module emcon_mechanism_rows
