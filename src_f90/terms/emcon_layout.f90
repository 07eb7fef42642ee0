!> Which freedoms a model has, and the pattern of the matrix between them.
module emcon_layout
   use emcon_bodies, only : bodies_find
   use emcon_couplings, only : equation_t
   use emcon_csr, only : csr_from_elements, csr_t
   use emcon_element_kinds, only : max_element_nodes
   use emcon_element_lists, only : element_lists
   use emcon_errors, only : error_t
   use emcon_given_sum, only : given_sum_append, given_sum_links, given_sum_t
   use emcon_numbering, only : numbering_t
   use emcon_reduction, only : freedom_numbers
   use emcon_solid, only : solid_t
   implicit none
   private
   public :: layout_bodies, layout_pattern

contains

   !> Bodies, and which freedoms are part of the model.
   pure subroutine layout_bodies(solid, given, equation, body, n_body, is_alive)
      type(solid_t), intent(in) :: solid
      type(given_sum_t), intent(in) :: given
      type(equation_t), intent(in) :: equation(:)   !! (any) of the scene
      integer, allocatable, intent(out) :: body(:)           !! (n_node) connected part; 0: of none
      integer, intent(out) :: n_body             !! largest number in `body`
      logical, allocatable, intent(out) :: is_alive(:, :)    !! (2, n_node)
      integer, allocatable :: node(:, :), link(:, :)
      integer :: i, k

      allocate(node, source=solid%node)
      if (given%is_any) then
         call given_sum_links(given, link)
         k = size(node, 2)
         node = reshape(node, [max_element_nodes, k + size(link, 2)], pad=[0])
         node(:2, k + 1:) = link
      end if
      call bodies_find(node, solid%n_node, body, n_body)
      allocate(is_alive(2, solid%n_node))
      is_alive = spread(body > 0, 1, 2)
      if (given%is_any) call keep_alive(solid, given, is_alive)
      do i = 1, size(equation)
         do k = 1, size(equation(i)%node)
            is_alive(equation(i)%dof(k), equation(i)%node(k)) = .true.
         end do
      end do
   end subroutine layout_bodies

   !> Of nodes without element only those freedoms that are given something.
   pure subroutine keep_alive(solid, given, is_alive)
      type(solid_t), intent(in) :: solid
      type(given_sum_t), intent(in) :: given
      logical, intent(inout) :: is_alive(:, :)
      integer :: i, e

      do i = 1, size(is_alive, 2)
         is_alive(:, i) = given%joined%row_start(2*i:2*i + 1) &
            > given%joined%row_start(2*i - 1:2*i)
      end do
      do e = 1, solid%n_element
         do i = 1, max_element_nodes
            if (solid%node(i, e) > 0) is_alive(:, solid%node(i, e)) = .true.
         end do
      end do
   end subroutine keep_alive

   !> Where freedoms of elements, and those that are given something, meet; and each one alive with
   !> itself. Rows are those of `freedom_numbers`.
   subroutine layout_pattern(solid, given, is_alive, numbering, matrix, slot, error)
      type(solid_t), intent(in) :: solid
      type(given_sum_t), intent(in) :: given
      logical, intent(in) :: is_alive(:, :)                  !! (2, n_node)
      type(numbering_t), intent(in) :: numbering
      type(csr_t), intent(out) :: matrix                     !! unknown and dependent freedoms
      integer, allocatable, intent(out) :: slot(:)           !! of the element entries
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: start(:), list(:), number(:)
      integer :: n

      call element_lists(solid, 2, start, list)
      n = sum((start(2:) - start(:size(start) - 1))**2)
      if (given%is_any) call given_sum_append(given, start, list)
      call append_bare_freedoms(is_alive, start, list)
      allocate(number, source=freedom_numbers(numbering))
      list = number(list)
      call csr_from_elements(matrix, numbering%n_unknown + numbering%n_dependent, start, list, &
         slot, error)
      if (allocated(error)) return
      if (given%is_any) slot = slot(:n)
   end subroutine layout_pattern

   !> Freedoms that stand in no list so far, as lists of one each.
   pure subroutine append_bare_freedoms(is_alive, start, list)
      logical, intent(in) :: is_alive(:, :)
      integer, allocatable, intent(inout) :: start(:), list(:)
      integer, allocatable :: bare(:)
      logical, allocatable :: is_bare(:)
      integer :: i, n

      is_bare = reshape(is_alive, [size(is_alive)])
      is_bare(list) = .false.
      bare = pack([(i, i = 1, size(is_bare))], is_bare)
      n = size(list)
      list = [list, bare]
      start = [start, [(n + 1 + i, i = 1, size(bare))]]
   end subroutine append_bare_freedoms

end module emcon_layout
