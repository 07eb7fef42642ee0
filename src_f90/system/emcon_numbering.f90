!> Which degrees of freedom are unknowns, and which are prescribed.
module emcon_numbering
   use emcon_kinds, only : wp
   use emcon_scene, only : prescribed_t
   implicit none
   private
   public :: numbering_t, numbering_init, pick_unknowns, add_to_dofs

   type :: numbering_t
      integer :: n_unknown = 0
      integer, allocatable :: unknown(:, :)      !! (n_dim, n_node) 1..n_unknown; 0: prescribed
      integer, allocatable :: dof(:)             !! (n_unknown) place in an (n_dim, n_node) array
   end type numbering_t

contains

   !> Number all degrees of freedom that `prescribed` does not name, of nodes that belong to a
   !> body: a node without element has neither mass nor stiffness, it stays where it is.
   subroutine numbering_init(self, n_dim, body, prescribed)
      type(numbering_t), intent(out) :: self
      integer, intent(in) :: n_dim
      integer, intent(in) :: body(:)             !! (n_node) 0: no element
      type(prescribed_t), intent(in) :: prescribed(:)
      integer :: i, a, k

      allocate(self%unknown(n_dim, size(body)), source=1)
      do i = 1, size(body)
         if (body(i) == 0) self%unknown(:, i) = 0
      end do
      do k = 1, size(prescribed)
         self%unknown(prescribed(k)%dof, prescribed(k)%node) = 0
      end do
      self%n_unknown = sum(self%unknown)
      allocate(self%dof(self%n_unknown))
      k = 0
      do i = 1, size(body)
         do a = 1, n_dim
            if (self%unknown(a, i) == 0) cycle
            k = k + 1
            self%unknown(a, i) = k
            self%dof(k) = a + n_dim*(i - 1)
         end do
      end do
   end subroutine numbering_init

   !> The entries of `field` that belong to unknowns.
   pure subroutine pick_unknowns(self, field, vector)
      type(numbering_t), intent(in) :: self
      real(wp), intent(in), contiguous :: field(:, :)    !! (n_dim, n_node)
      real(wp), intent(out) :: vector(:)                 !! (n_unknown)
      integer :: k, n_dim

      n_dim = size(field, 1)
      do k = 1, self%n_unknown
         vector(k) = field(1 + mod(self%dof(k) - 1, n_dim), 1 + (self%dof(k) - 1)/n_dim)
      end do
   end subroutine pick_unknowns

   !> Add `factor` times `vector` to the unknown entries of `field`.
   pure subroutine add_to_dofs(self, vector, factor, field)
      type(numbering_t), intent(in) :: self
      real(wp), intent(in) :: vector(:)                  !! (n_unknown)
      real(wp), intent(in) :: factor
      real(wp), intent(inout), contiguous :: field(:, :) !! (n_dim, n_node)
      integer :: k, n_dim, a, i

      n_dim = size(field, 1)
      do k = 1, self%n_unknown
         a = 1 + mod(self%dof(k) - 1, n_dim)
         i = 1 + (self%dof(k) - 1)/n_dim
         field(a, i) = field(a, i) + factor*vector(k)
      end do
   end subroutine add_to_dofs

end module emcon_numbering
