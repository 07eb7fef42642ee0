!> All elements of a scene: reference geometry, laws, mass.
module emcon_solid
   use emcon_element, only : element_geometry_t
   use emcon_element_pack, only : element_pack_t, pack_fill
   use emcon_element_plane, only : reference_gradient
   use emcon_element_space, only : n_space, space_element_add_mass, space_element_place
   use emcon_errors, only : err_input, error_t, raise
   use emcon_host_law, only : host_law_t, host_law_take, host_rest_stiffness
   use emcon_incompatible_modes, only : modes_init
   use emcon_kinds, only : wp
   use emcon_law, only : law_box_t, law_response_plane, law_response_t, law_t, n_lane
   use emcon_law_space, only : law_response_space, n_strain, space_response_t
   use emcon_law_registry, only : law_create, law_user, law_linearise, law_make_thin
   use emcon_materials, only : kinematics_corotated, kinematics_linear
   use emcon_scene, only : scene_t, where_text
   use emcon_shape, only : shape_table_t, shape_tabulate
   use emcon_steps, only : step_square
   use emcon_text, only : string_t, to_text
   implicit none
   private
   public :: solid_t, solid_init

   !> How stress at the quadrature points of a kind of elements is carried to its nodes.
   type :: to_nodes_t
      real(wp), allocatable :: weight(:, :)              !! (n_gp, n_node) part of point in node
   end type to_nodes_t

   !> What the deck has of each element.
   type :: solid_deck_t
      integer, allocatable :: label(:)                   !! (n_element)
      type(string_t), allocatable :: material(:)         !! names of the materials
      integer, allocatable :: section(:)                 !! (n_element)
   end type solid_deck_t

   !> How each element responds, (n_element).
   type :: element_traits_t
      logical, allocatable :: is_linear(:)               !! small strains in all steps
      logical, allocatable :: is_corotated(:)            !! in a frame that turns
      logical, allocatable :: is_small(:)                !! one of these two
      logical, allocatable :: is_rigid(:)                !! mass alone, no forces
      logical, allocatable :: is_thin(:)                 !! plane stress
      logical, allocatable :: may_lock(:)                !! at small changes of volume
      logical, allocatable :: is_stiff_bent(:)           !! where it bends
      logical, allocatable :: has_mean(:)                !! volume resists in the mean
      logical, allocatable :: has_inertia(:)
   contains
      procedure :: square_of
   end type element_traits_t

   !> Laws that a program gives.
   type :: solid_host_t
      logical :: is_used = .false.                       !! some law is one of these
      type(host_law_t), allocatable :: law(:)            !! like `law` of solid_t
      integer, allocatable :: n_point(:)                 !! quadrature points, of each
      integer, allocatable :: first_point(:)             !! (n_element) among these; 0: law of ours
   end type solid_host_t

   type :: solid_mass_t
      real(wp), allocatable :: consistent(:, :, :)       !! (n_most, n_most, n_element) [M]
      real(wp), allocatable :: of_volume(:, :)           !! int rho N_i: (n_most, n_element) [M]
   end type solid_mass_t

   type :: solid_t
      integer :: n_dim = 0
      logical :: is_axial = .false.                      !! solids of revolution
      logical :: is_single = .false.                     !! of space or of revolution
      integer :: n_element = 0
      integer :: n_node = 0
      type(solid_deck_t) :: deck
      integer, allocatable :: kind(:)                    !! (n_element) index into `to_nodes`
      type(to_nodes_t), allocatable :: to_nodes(:)       !! one per kind of the scene
      integer, allocatable :: node(:, :)                 !! (n_most, n_element) as in scene_t
      integer, allocatable :: law_of(:)                  !! (n_element) index into `law`
      type(element_traits_t) :: trait
      real(wp), allocatable :: x(:, :)                   !! (n_dim, n_node) [L], for corotated ones
      type(element_geometry_t), allocatable :: geometry(:)   !! (n_element)
      type(element_pack_t), allocatable :: pack(:)         !! all but small and rigid ones
      !> One per material; behind them, if there are linear elements, those for these; behind all
      !> these, if there are thin ones, the same in plane stress
      type(law_box_t), allocatable :: law(:)
      type(law_box_t), allocatable :: rest(:)            !! like `law`, without U: `has_mean`
      type(solid_host_t) :: host
      type(solid_mass_t) :: mass
      real(wp), allocatable :: thickness(:)              !! (n_element) [L]
      !> (n_most, n_element) force that a displacement of one causes before anything cancels [M/T^2]
      real(wp), allocatable :: stiffness(:, :)
   end type solid_t

   real(wp), parameter :: two_pi = 8.0_wp*atan(1.0_wp)

contains

   !> Geometry, laws and mass of the elements of `scene`, with the laws that a program gives.
   subroutine solid_init(self, scene, error, user)
      type(solid_t), intent(out) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      type(host_law_t), intent(in), optional :: user(:)    !! one for each such material
      type(shape_table_t) :: stiffness(size(scene%element%kinds)), mass(size(scene%element%kinds))
      real(wp), allocatable :: at_rest(:)
      integer :: e, k, n, n_most

      n = size(scene%element%kind)
      self%n_dim = size(scene%x, 1)
      self%is_axial = scene%is_axial
      self%is_single = self%n_dim == n_space .or. self%is_axial
      self%n_element = n
      self%n_node = size(scene%x, 2)
      self%deck%label = scene%element%label
      allocate(self%deck%material(size(scene%material)))
      do k = 1, size(scene%material)
         self%deck%material(k)%text = ""
         if (allocated(scene%material(k)%name)) self%deck%material(k)%text = scene%material(k)%name
      end do
      self%kind = scene%element%kind
      self%node = scene%element%node
      allocate(self%law_of(n), self%geometry(n), self%thickness(n))
      n_most = size(self%node, 1)
      allocate(self%mass%consistent(n_most, n_most, n), source=0.0_wp)
      allocate(self%mass%of_volume(n_most, n), self%stiffness(n_most, n), source=0.0_wp)
      self%deck%section = scene%element%section
      call tell_apart(self, scene)
      if (any(self%trait%is_corotated)) allocate(self%x, source=scene%x)
      call init_laws(self, scene, at_rest, error, user)
      if (allocated(error)) return
      call init_kinds(self, scene, stiffness, mass, error)
      if (allocated(error)) return
      do e = 1, n
         k = scene%section(scene%element%section(e))%material
         self%law_of(e) = k + merge(size(self%law)/2, 0, self%trait%is_thin(e))
         self%thickness(e) = scene%section(scene%element%section(e))%thickness
         call init_element(self, scene%x, scene%material(k)%density, e, &
            stiffness(self%kind(e)), mass(self%kind(e)))
         if (.not. self%trait%is_rigid(e)) call estimate_stiffness(self, at_rest(self%law_of(e)), e)
         if (self%trait%is_small(e)) self%law_of(e) = size(scene%material) + self%law_of(e)
         call check_law(self, scene, e, error)
         if (allocated(error)) return
         if (scene%element%kinds(self%kind(e))%has_modes) call make_modes(self, e, &
            stiffness(self%kind(e)), error)
         if (allocated(error)) return
         if (any(self%geometry(e)%weight <= 0.0_wp)) then
            call raise(error, err_input, "element " // to_text(scene%element%label(e)) // &
               " is inverted or has no " // trim(merge("volume", "area  ", size(scene%x, 1) &
               == n_space)) // "; check the order of its nodes")
            return
         end if
      end do
      call divide_laws(self, error)
      if (allocated(error)) return
      call number_points(self)
      call make_packs(self)
   end subroutine solid_init

   !> An element that grows normal to the plane asks for a law that is known there.
   subroutine check_law(self, scene, e, error)
      type(solid_t), intent(in) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e
      type(error_t), allocatable, intent(out) :: error

      if (self%trait%is_rigid(e) .or. .not. self%trait%is_thin(e)) return
      if (allocated(self%law(self%law_of(e))%law)) return
      call raise(error, err_input, where_text(scene, scene%element%origin(e)) // ": error: " &
         // "element " // to_text(self%deck%label(e)) // " is of type " &
         // trim(scene%element%kinds(self%kind(e))%name) // ", plane stress, in which the law of " &
         // "material " &
         // self%deck%material(scene%section(scene%element%section(e))%material)%text &
         // " is not known: it gives no stress normal to the plane; take ELASTIC, NEO HOOKE, " &
         // "MOONEY-RIVLIN or YEOH, or plane strain, CPE")
   end subroutine check_law

   !> The incompatible modes of element `e`, by the moduli of its law at rest.
   subroutine make_modes(self, e, table, error)
      type(solid_t), intent(inout) :: self
      integer, intent(in) :: e                   !! 1..n_element
      type(shape_table_t), intent(in) :: table   !! for stiffness
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rest(n_strain) = 0.0_wp
      type(law_response_t) :: plane
      type(space_response_t) :: space

      if (self%trait%is_rigid(e)) return
      associate (law => self%law(self%law_of(e)))
         if (.not. allocated(law%law)) then
            call raise(error, err_input, "element " // to_text(self%deck%label(e)) // " has " &
               // "incompatible modes, for which the law given for material " &
               // self%deck%material(1 + mod(self%law_of(e) - 1, size(self%deck%material)))%text &
               // " tells no moduli; take " // trim(merge("C3D8 or C3D20", "CPE4 or CPE8 ", &
               self%n_dim == n_space)))
         else if (self%n_dim == n_space) then
            call law_response_space(law%law, rest, rest, space)
            call modes_init(self%geometry(e), table, space%tangent)
         else
            call law_response_plane(law%law, rest(:3), rest(:3), plane)
            call modes_init(self%geometry(e), table, plane%tangent)
         end if
      end associate
   end subroutine make_modes

   !> What laws are without their resistance to a change of volume, where elements ask for it.
   subroutine divide_laws(self, error)
      type(solid_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: e, k

      allocate(self%rest(size(self%law)))
      do e = 1, self%n_element
         k = self%law_of(e)
         if (.not. self%trait%has_mean(e) .or. self%trait%is_rigid(e) &
            .or. allocated(self%rest(k)%law)) cycle
         if (allocated(self%law(k)%law)) call self%law(k)%law%divide(self%rest(k)%law)
         if (allocated(self%rest(k)%law)) cycle
         call raise(error, err_input, "element " // to_text(self%deck%label(e)) &
            // " takes the mean " &
            // "change of volume, which the law given for material " &
            // self%deck%material(k)%text // &
            " does not tell apart; take " // trim(merge("C3D8 or C3D20", "CPE4 or CPE8 ", &
            self%n_dim == n_space)))
         return
      end do
   end subroutine divide_laws

   !> What elements are by their kinds, sections and bodies.
   pure subroutine tell_apart(self, scene)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer :: e, k

      allocate(self%trait%is_rigid(self%n_element), source=.false.)
      do k = 1, size(scene%rigid)
         self%trait%is_rigid(scene%rigid(k)%element) = .true.
      end do
      allocate(self%trait%is_thin(self%n_element), self%trait%has_mean(self%n_element), &
         self%trait%may_lock(self%n_element), self%trait%is_stiff_bent(self%n_element), &
         self%trait%has_inertia(self%n_element), self%trait%is_linear(self%n_element), &
         self%trait%is_corotated(self%n_element))
      do e = 1, self%n_element
         associate (kind => scene%element%kinds(scene%element%kind(e)), &
               section => scene%section(scene%element%section(e)), &
               is_free => .not. self%trait%is_rigid(e))
            self%trait%is_thin(e) = kind%is_thin
            self%trait%has_mean(e) = kind%has_mean_volume
            ! Modes give way to a change of volume that is linear in the displacements.
            self%trait%may_lock(e) = kind%may_lock() .or. (kind%has_modes &
               .and. any(step_square(scene%step) > 0.0_wp))
            self%trait%is_stiff_bent(e) = kind%is_stiff_bent() .and. is_free
            self%trait%has_inertia(e) = .not. section%is_massless
            self%trait%is_linear(e) = section%kinematics == kinematics_linear .and. is_free
            self%trait%is_corotated(e) = section%kinematics == kinematics_corotated .and. is_free
         end associate
      end do
      self%trait%is_small = self%trait%is_linear .or. self%trait%is_corotated
   end subroutine tell_apart

   !> Part of squares in the strains of element `e` in a step in which they have `square`; a frame
   !> that turns needs them in all steps.
   pure real(wp) function square_of(self, e, square)
      class(element_traits_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: square             !! 1, or 0: small strains

      square_of = square
      if (self%is_corotated(e)) square_of = 1.0_wp
      if (self%is_linear(e)) square_of = 0.0_wp
   end function square_of

   !> Pack the elements of each kind and law, as they come in the scene.
   pure subroutine make_packs(self)
      type(solid_t), intent(inout) :: self
      integer :: list(self%n_element), e, i, k, law, n, n_pack, pass

      if (self%is_axial) then                    ! these respond one by one
         allocate(self%pack(0))
         return
      end if
      do pass = 1, 2                             ! count, then fill
         n_pack = 0
         do k = 1, maxval([0, self%kind])
            do law = 1, size(self%law)
               n = 0
               do e = 1, self%n_element
                  if (self%trait%is_small(e) .or. self%trait%is_rigid(e)) cycle
                  if (self%kind(e) /= k .or. self%law_of(e) /= law) cycle
                  n = n + 1
                  list(n) = e
               end do
               do i = 1, n, n_lane
                  n_pack = n_pack + 1
                  if (pass == 2) call pack_fill(self%pack(n_pack), list(i:min(n, i + n_lane - 1)), &
                     law, self%node, self%geometry)
               end do
            end do
         end do
         if (pass == 1) allocate(self%pack(n_pack))
      end do
   end subroutine make_packs

   !> What the shapes of the kinds say, of those that elements have.
   subroutine init_kinds(self, scene, stiffness, mass, error)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(shape_table_t), intent(inout) :: stiffness(:), mass(:)   !! (n_kind)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, e

      allocate(self%to_nodes(size(scene%element%kinds)))
      do k = 1, size(scene%element%kinds)
         e = findloc(self%kind, k, 1)
         if (e == 0) cycle
         associate (kind => scene%element%kinds(k))
            if (.not. allocated(kind%shape)) then
               call raise(error, err_input, where_text(scene, scene%element%origin(e)) &
                  // ": error: element " // to_text(self%deck%label(e)) // " is of type " &
                  // trim(kind%name) // ", a *USER ELEMENT: a program has to give its shape, " &
                  // "after the deck is read and before the model is built")
               return
            end if
            call shape_tabulate(kind%shape, .false., stiffness(k))
            call shape_tabulate(kind%shape, .true., mass(k))
            call kind%shape%to_nodes(self%to_nodes(k)%weight)
         end associate
      end do
   end subroutine init_kinds

   !> The laws, and the largest entry of the tangent of each at rest.
   subroutine init_laws(self, scene, at_rest, error, user)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      real(wp), allocatable, intent(out) :: at_rest(:)   !! as `law` [M/(L T^2)]
      type(error_t), allocatable, intent(out) :: error
      type(host_law_t), intent(in), optional :: user(:)
      integer :: k, n, n_law

      n_law = size(scene%material)
      if (any(self%trait%is_small)) n_law = n_law + size(scene%material)
      n = n_law
      if (any(self%trait%is_thin)) n = n + n_law
      allocate(self%law(n), self%host%law(n))
      allocate(at_rest(n), source=0.0_wp)
      do k = 1, size(scene%material)
         select case (scene%material(k)%law)
         case (0)
            cycle
         case (law_user)
            call host_law_take(scene, scene%material(k), self%host%law(k), error, user)
            if (allocated(error)) return
            call move_alloc(self%host%law(k)%law, self%law(k)%law)
            if (allocated(self%host%law(k)%energy)) call host_rest_stiffness(self%host%law(k), &
               at_rest(k), error)
         case default
            call law_create(scene%material(k)%law, scene%material(k)%constant, self%law(k)%law, &
               error)
            if (allocated(error)) then
               error%message = "material " // scene%material(k)%name // ": " // error%message
               return
            end if
            self%law(k)%law%density = scene%material(k)%density
         end select
         if (allocated(error)) return
         if (.not. allocated(self%law(k)%law)) cycle
         at_rest(k) = rest_stiffness(self%law(k)%law)
         if (any(self%trait%is_small)) call law_linearise(self%law(k)%law, &
            self%law(size(scene%material) + k)%law)
      end do
      if (.not. any(self%trait%is_thin)) return
      do k = 1, n_law
         if (.not. allocated(self%law(k)%law)) cycle
         call law_make_thin(self%law(k)%law, self%law(n_law + k)%law)
         if (.not. allocated(self%law(n_law + k)%law)) cycle
         at_rest(n_law + k) = rest_stiffness(self%law(n_law + k)%law)
      end do
   end subroutine init_laws

   !> The largest entry of the tangent of a law at rest.
   pure real(wp) function rest_stiffness(law)
      class(law_t), intent(in) :: law
      real(wp), parameter :: rest(3) = 0.0_wp
      type(law_response_t) :: state

      call law_response_plane(law, rest, rest, state)
      rest_stiffness = maxval(abs(state%tangent))
   end function rest_stiffness

   !> Number the quadrature points of each given law through all its elements.
   pure subroutine number_points(self)
      type(solid_t), intent(inout) :: self
      integer :: e

      allocate(self%host%n_point(size(self%host%law)), self%host%first_point(self%n_element), &
         source=0)
      do e = 1, self%n_element
         associate (k => self%law_of(e))
            if (self%trait%is_rigid(e) .or. .not. allocated(self%host%law(k)%energy)) cycle
            self%host%first_point(e) = self%host%n_point(k) + 1
            self%host%n_point(k) = self%host%n_point(k) + self%geometry(e)%n_gp
         end associate
      end do
      self%host%is_used = any(self%host%n_point > 0)
   end subroutine number_points

   pure subroutine init_element(self, x, density, e, stiffness, mass)
      type(solid_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :), density
      integer, intent(in) :: e
      type(shape_table_t), intent(in) :: stiffness, mass
      real(wp) :: local(size(x, 1), stiffness%n_node), gradient(size(x, 1), stiffness%n_node), det
      real(wp) :: rho_dv, consistent(stiffness%n_node, stiffness%n_node), depth
      integer :: n, k, i

      n = stiffness%n_node
      do i = 1, n
         local(:, i) = x(:, self%node(i, e)) - x(:, self%node(1, e))
      end do
      if (size(x, 1) == n_space) then
         call space_element_place(self%geometry(e), stiffness, local)
         call space_element_add_mass(mass, local, density, consistent, self%mass%of_volume(:n, e))
         if (self%trait%has_inertia(e)) self%mass%consistent(:n, :n, e) = consistent
         return
      end if
      self%geometry(e)%n_node = n
      self%geometry(e)%n_gp = stiffness%n_gp
      allocate(self%geometry(e)%gradient(size(x, 1), n, stiffness%n_gp), &
         self%geometry(e)%weight(stiffness%n_gp))
      if (self%is_axial) allocate(self%geometry(e)%circle(n, stiffness%n_gp))
      do k = 1, stiffness%n_gp
         call reference_gradient(n, local, stiffness%slope(:, :, k), gradient, det)
         call find_depth(self, e, x, stiffness%value(:, k), depth)
         self%geometry(e)%gradient(:, :, k) = gradient
         self%geometry(e)%weight(k) = stiffness%weight(k)*det*depth
         if (self%is_axial) self%geometry(e)%circle(:, k) = stiffness%value(:, k)*(two_pi/depth)
      end do
      do k = 1, mass%n_gp
         call reference_gradient(n, local, mass%slope(:, :, k), gradient, det)
         call find_depth(self, e, x, mass%value(:, k), depth)
         rho_dv = density*mass%weight(k)*det*depth
         self%mass%of_volume(:n, e) = self%mass%of_volume(:n, e) + rho_dv*mass%value(:, k)
         if (.not. self%trait%has_inertia(e)) cycle
         do i = 1, n
            self%mass%consistent(:n, i, e) = self%mass%consistent(:n, i, e) &
               + rho_dv*mass%value(i, k)*mass%value(:, k)
         end do
      end do
   end subroutine init_element

   !> How deep a point is: the thickness, or the length of its circle.
   pure subroutine find_depth(self, e, x, value, depth)
      type(solid_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1 to n_element
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      real(wp), intent(in) :: value(:)           !! shape functions at the point
      real(wp), intent(out) :: depth             !! [L]

      depth = self%thickness(e)
      if (self%is_axial) depth = two_pi*dot_product(value, x(1, self%node(:size(value), e)))
   end subroutine find_depth

   !> A displacement u rounds the strain by epsilon |grad N| |u|, however small the strain is; what
   !> force that makes follows from the law's stiffness at rest: docs/theory.md, eq. (26).
   pure subroutine estimate_stiffness(self, at_rest, e)
      type(solid_t), intent(inout) :: self
      real(wp), intent(in) :: at_rest
      integer, intent(in) :: e
      real(wp) :: spread, by(self%geometry(e)%n_node)
      integer :: k, i

      associate (geometry => self%geometry(e))
         do k = 1, geometry%n_gp
            by = 0.0_wp
            if (self%is_axial) by = abs(geometry%circle(:, k))
            spread = geometry%weight(k)*at_rest &
               *(sum(abs(geometry%gradient(:, :, k))) + sum(by))
            do i = 1, geometry%n_node
               self%stiffness(i, e) = self%stiffness(i, e) &
                  + spread*(sum(abs(geometry%gradient(:, i, k))) + by(i))
            end do
         end do
      end associate
   end subroutine estimate_stiffness

end module emcon_solid
