!> The faces of contact surfaces in space, and what contact does to each.
!>
!> A force on a node belongs to the faces there, whichever side of a pair it is on: so both sides of
!> a pair show all of the pressure between them. Friction goes where pressure does. Source:
!> docs/theory.md, section 14.
module emcon_contact_faces
   use, intrinsic :: ieee_arithmetic, only : ieee_is_nan, ieee_quiet_nan, ieee_value
   use emcon_facet_values, only : facets_share
   use emcon_facets, only : facets_normal, facets_t
   use emcon_kinds, only : dp, wp
   use emcon_mesh, only : surface_t
   use emcon_quantities, only : contact_field
   use emcon_scene, only : scene_t
   use emcon_sort, only : find_sorted, unique_sorted
   use emcon_stepper, only : stepper_t
   use emcon_surface_facets, only : surface_facets
   implicit none
   private
   public :: contact_faces_t, contact_faces_find, contact_faces_cells, face_values_t, &
      contact_faces_values

   !> Less than this part of the largest pressure is what frames of neighbours leave on a face.
   real(dp), parameter :: least_pressure = 0.01_dp

   !> Each face of an element once, of the first surface that has it.
   type :: contact_faces_t
      integer, allocatable :: node(:)            !! (n_point) of the scene, ascending
      integer, allocatable :: vertex(:, :)       !! (most, n_face) as indices into `node`, in turn
      integer, allocatable :: surface(:)         !! (n_face) number in the scene
      type(facets_t) :: facets                   !! the same by nodes of the scene
   end type contact_faces_t

   !> What contact does in the present state; signs as of nodes.
   type :: face_values_t
      real(dp), allocatable :: force(:, :)       !! (n_dim, n_face) [M L/T^2]
      real(dp), allocatable :: pressure(:, :)    !! (1, n_face) along the normal [M/(L T^2)]
      real(dp), allocatable :: gap(:, :)         !! (1, n_face) mean of slave nodes; NaN: none [L]
      real(dp), allocatable :: status(:, :)      !! (1, n_face) 0 open, 1 closed, 2 slides
      real(dp), allocatable :: shear(:, :)       !! (n_dim, n_face) force along it over its area
      !> (n_dim, n_face) along it, mean of the slave nodes that rub; 0: none [L]
      real(dp), allocatable :: slip(:, :)
      real(dp), allocatable :: at_node(:, :)     !! (1, n_point) mean pressure of the faces there
      real(dp), allocatable :: gap_there(:, :)   !! (1, n_point) of slave nodes; NaN: none [L]
   end type face_values_t

contains

   !> The faces of all surfaces of contact pairs.
   pure subroutine contact_faces_find(self, scene)
      type(contact_faces_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      logical, allocatable :: is_listed(:, :)
      integer, allocatable :: element(:), face(:), number(:)
      type(surface_t) :: listed
      integer :: i, n, s

      allocate(is_listed(maxval([0, scene%element%kinds%n_face]), size(scene%element%kind)), &
         source=.false.)
      allocate(element(count_faces(scene)))
      allocate(face(size(element)), number(size(element)))
      n = 0
      do s = 1, size(scene%surface)
         if (.not. is_met(scene, s)) cycle
         associate (surface => scene%surface(s))
            do i = 1, size(surface%element)
               associate (is_known => is_listed(surface%face(i), surface%element(i)))
                  if (is_known) cycle
                  is_known = .true.
               end associate
               n = n + 1
               element(n) = surface%element(i)
               face(n) = surface%face(i)
               number(n) = s
            end do
         end associate
      end do
      listed%element = element(:n)
      listed%face = face(:n)
      self%surface = number(:n)
      self%facets%n_dim = scene%n_dim
      call surface_facets(scene, listed, self%facets%facet)
      self%facets%n_facet = size(self%facets%facet, 2)
      associate (facet => self%facets%facet)
         self%node = unique_sorted(pack(facet, facet > 0))
         allocate(self%vertex(size(facet, 1), size(facet, 2)), source=0)
         do i = 1, size(facet, 2)
            do s = 1, count(facet(:, i) > 0)
               self%vertex(s, i) = find_sorted(self%node, facet(s, i))
            end do
         end do
      end associate
   end subroutine contact_faces_find

   !> Is a surface one of faces of elements, in some pair?
   pure logical function is_met(scene, s)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: s                   !! of the scene

      is_met = any(scene%pair%slave == s .or. scene%pair%master == s) &
         .and. allocated(scene%surface(s)%element)
   end function is_met

   !> Faces of these surfaces, some of them perhaps several times.
   pure integer function count_faces(scene) result(n)
      type(scene_t), intent(in) :: scene
      integer :: s

      n = 0
      do s = 1, size(scene%surface)
         if (is_met(scene, s)) n = n + size(scene%surface(s)%element)
      end do
   end function count_faces

   !> The faces as cells of VTK files: corners first, then the nodes between them.
   pure subroutine contact_faces_cells(self, node, vtk_type)
      type(contact_faces_t), intent(in) :: self
      integer, allocatable, intent(out) :: node(:, :)    !! (most, n_face), behind the last one 0
      integer, allocatable, intent(out) :: vtk_type(:)   !! (n_face)
      !> By the number of nodes: triangle and quadrilateral, and both with mid-side nodes
      integer, parameter :: kind(8) = [0, 0, 5, 9, 0, 22, 0, 23]
      integer :: f, n

      node = self%vertex
      allocate(vtk_type(size(node, 2)))
      do f = 1, size(node, 2)
         n = count(node(:, f) > 0)
         vtk_type(f) = kind(n)
         if (n > 4) node(:n, f) = [self%vertex(1:n:2, f), self%vertex(2:n:2, f)]
      end do
   end subroutine contact_faces_cells

   !> What contact does to each face.
   subroutine contact_faces_values(self, stepper, values)
      type(contact_faces_t), intent(in) :: self
      type(stepper_t), intent(inout) :: stepper
      type(face_values_t), intent(out) :: values
      real(dp), allocatable :: of_all(:, :)
      real(wp), allocatable :: force(:, :), pressed(:, :), share(:, :), push(:, :), normal(:, :)
      integer :: f, n

      allocate(of_all, source=contact_field(stepper, "CF"))
      force = real(of_all(:, self%node), wp)
      pressed = force
      if (size(stepper%march%state%friction) > 0) pressed = force &
         - stepper%march%state%friction(:, self%node)
      associate (m => size(self%vertex, 2), n_dim => size(force, 1))
         allocate(normal(n_dim, m), push(n_dim, m), share(size(self%vertex, 1), m))
         allocate(values%pressure(1, m), values%at_node(1, size(self%node)), source=0.0_dp)
      end associate
      do f = 1, size(normal, 2)
         normal(:, f) = facets_normal(self%facets, f, stepper%scene%x, stepper%march%state%u)
      end do
      call facets_share(self%vertex, normal, pressed, share)
      do f = 1, size(push, 2)
         n = count(self%vertex(:, f) > 0)
         associate (node => self%vertex(:n, f), square => dot_product(normal(:, f), normal(:, f)))
            push(:, f) = matmul(force(:, node), share(:n, f))
            if (square > 0.0_wp) values%pressure(1, f) = &
               real(-dot_product(push(:, f), normal(:, f))/square, dp)
            values%at_node(1, node) = values%at_node(1, node) + real(share(:n, f), dp) &
               *values%pressure(1, f)
         end associate
      end do
      values%force = real(push, dp)
      allocate(values%shear, values%slip, mold=values%force)
      call find_along(self, stepper, push, normal, values%shear, values%slip)
      deallocate(of_all)
      allocate(of_all, source=contact_field(stepper, "CDIS"))
      values%gap_there = of_all(:, self%node)
      call find_gaps(self, values%gap_there, values%gap)
      call find_status(self, stepper, values%pressure, values%status)
   end subroutine contact_faces_values

   !> The means of the gaps that nodes of a face have.
   pure subroutine find_gaps(self, at_node, gap)
      type(contact_faces_t), intent(in) :: self
      real(dp), intent(in) :: at_node(:, :)      !! (1, n_point)
      real(dp), allocatable, intent(out) :: gap(:, :)
      integer :: f

      allocate(gap(1, size(self%vertex, 2)), source=ieee_value(1.0_dp, ieee_quiet_nan))
      do f = 1, size(gap, 2)
         associate (here => at_node(1, pack(self%vertex(:, f), self%vertex(:, f) > 0)))
            if (all(ieee_is_nan(here))) cycle
            gap(1, f) = sum(here, mask=.not. ieee_is_nan(here)) &
               /count(.not. ieee_is_nan(here))
         end associate
      end do
   end subroutine find_gaps

   !> Traction and slip along each face, in runs with friction.
   subroutine find_along(self, stepper, push, normal, shear, slip)
      type(contact_faces_t), intent(in) :: self
      type(stepper_t), intent(in) :: stepper
      real(wp), intent(in) :: push(:, :)         !! (n_dim, n_face) forces [M L/T^2]
      real(wp), intent(in) :: normal(:, :)       !! (n_dim, n_face) as long as its area [L^2]
      real(dp), intent(out) :: shear(:, :)       !! (n_dim, n_face) [M/(L T^2)]
      real(dp), intent(out) :: slip(:, :)        !! (n_dim, n_face) [L]
      real(wp), allocatable :: slid(:, :)
      integer, allocatable :: rubs(:)
      real(wp) :: area
      integer :: f

      shear = 0.0_dp
      slip = 0.0_dp
      if (size(stepper%march%state%contacts%drag) == 0) return
      call nodes_slid(stepper, slid, rubs)
      do f = 1, size(push, 2)
         area = norm2(normal(:, f))
         if (.not. area > 0.0_wp) cycle
         associate (node => self%node(pack(self%vertex(:, f), self%vertex(:, f) > 0)), &
               n => normal(:, f)/area)
            shear(:, f) = real((push(:, f) - dot_product(n, push(:, f))*n)/area, dp)
            associate (mean => sum(slid(:, node), 2)/max(1, sum(rubs(node))))
               slip(:, f) = real(mean - dot_product(n, mean)*n, dp)
            end associate
         end associate
      end do
   end subroutine find_along

   !> How nodes have slid in space, summed over the contacts there, and the number of these.
   subroutine nodes_slid(stepper, slid, rubs)
      type(stepper_t), intent(in) :: stepper
      real(wp), allocatable, intent(out) :: slid(:, :)   !! (n_dim, n_node) [L]
      integer, allocatable, intent(out) :: rubs(:)       !! (n_node)
      integer :: pair, i

      allocate(slid, source=0.0_wp*stepper%scene%x)
      allocate(rubs(size(slid, 2)), source=0)
      associate (system => stepper%march%system, contacts => stepper%march%state%contacts)
         do pair = 1, system%n_pair
            do i = 1, system%contact(pair)%contact%n_constraint
               associate (id => system%first_constraint(pair) + i, &
                     node => system%contact(pair)%contact%node(i))
                  if (.not. contacts%slip_path(id) > 0.0_wp) cycle
                  slid(:, node) = slid(:, node) + contacts%slid(:, id)
                  rubs(node) = rubs(node) + 1
               end associate
            end do
         end do
      end associate
   end subroutine nodes_slid

   !> A face is closed where a constraint of one of its nodes acts, or what acts on the other side
   !> presses on it.
   subroutine find_status(self, stepper, pressure, status)
      type(contact_faces_t), intent(in) :: self
      type(stepper_t), intent(inout) :: stepper
      real(dp), intent(in) :: pressure(:, :)     !! (1, n_face) [M/(L T^2)]
      real(dp), allocatable, intent(out) :: status(:, :)
      real(dp), allocatable :: acts(:, :), rubs(:, :)
      real(dp) :: of_node(size(self%node))
      integer :: f

      allocate(acts, source=contact_field(stepper, "CSTR"))
      allocate(rubs, source=contact_field(stepper, "CSHEAR"))
      of_node = max(acts(size(acts, 1), self%node), rubs(size(rubs, 1), self%node))
      allocate(status(1, size(self%vertex, 2)))
      do f = 1, size(status, 2)
         status(1, f) = maxval(of_node(pack(self%vertex(:, f), self%vertex(:, f) > 0)))
      end do
      where (pressure > least_pressure*maxval(pressure)) status = max(1.0_dp, status)
   end subroutine find_status

end module emcon_contact_faces
