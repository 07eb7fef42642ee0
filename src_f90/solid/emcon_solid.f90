!> All elements of a scene: reference geometry, laws, mass.
module emcon_solid
   use emcon_element, only : element_geometry_t
   use emcon_element_pack, only : element_pack_t, pack_begin, pack_geometry, pack_put
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
   public :: solid_t, solid_init, solid_geometry

   !> What the shape of a kind of elements says.
   type :: solid_shape_t
      type(shape_table_t) :: table                       !! at the points for stiffness
      !> (n_gp, n_node) how stress is carried to the nodes: part of point in node
      real(wp), allocatable :: to_nodes(:, :)
   end type solid_shape_t

   !> Geometry of the elements: in packs, and of those that respond alone.
   type :: solid_held_t
      !> (n_element) where it is: lane l of pack p, n_lane (p - 1) + l; or -k in `single`
      integer, allocatable :: at(:)
      type(element_geometry_t), allocatable :: single(:)
   end type solid_held_t

   !> What the deck has of each element.
   type :: solid_deck_t
      integer, allocatable :: label(:)                   !! (n_element)
      type(string_t), allocatable :: material(:)         !! names of the materials
      integer, allocatable :: section(:)                 !! (n_element)
   end type solid_deck_t

   !> How each element responds, (n_element).
   type :: element_traits_t
      integer, allocatable :: n_node(:)                  !! nodes
      integer, allocatable :: n_point(:)                 !! quadrature points
      logical, allocatable :: is_linear(:)               !! small strains in all steps
      logical, allocatable :: is_corotated(:)            !! in a frame that turns
      logical, allocatable :: is_small(:)                !! one of these two
      logical, allocatable :: is_rigid(:)                !! mass alone, no forces
      logical, allocatable :: is_thin(:)                 !! plane stress
      logical, allocatable :: may_lock(:)                !! at small changes of volume
      logical, allocatable :: is_stiff_bent(:)           !! where it bends
      logical, allocatable :: has_mean(:)                !! volume resists in the mean
      logical, allocatable :: has_modes(:)               !! that are incompatible
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
      logical :: is_of_rings = .false.                   !! solids of revolution
      logical :: is_single = .false.                     !! of space or of revolution
      integer :: n_element = 0
      integer :: n_node = 0
      type(solid_deck_t) :: deck
      integer, allocatable :: kind(:)                    !! (n_element) index into `shape`
      type(solid_shape_t), allocatable :: shape(:)       !! one per kind of the scene
      integer, allocatable :: node(:, :)                 !! (n_most, n_element) as in scene_t
      integer, allocatable :: law_of(:)                  !! (n_element) index into `law`
      type(element_traits_t) :: trait
      real(wp), allocatable :: x(:, :)                   !! (n_dim, n_node) [L], for corotated ones
      type(element_pack_t), allocatable :: pack(:)         !! all but small and rigid ones
      type(solid_held_t) :: held                         !! geometry
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
      type(shape_table_t) :: mass(size(scene%element%kinds))
      real(wp), allocatable :: at_rest(:)
      integer :: e, k, n, n_most

      n = size(scene%element%kind)
      self%n_dim = size(scene%x, 1)
      self%is_of_rings = scene%is_axial
      self%is_single = self%n_dim == n_space .or. self%is_of_rings
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
      n_most = size(self%node, 1)
      allocate(self%mass%consistent(n_most, n_most, n), source=0.0_wp)
      allocate(self%mass%of_volume(n_most, n), self%stiffness(n_most, n), source=0.0_wp)
      self%deck%section = scene%element%section
      call tell_apart(self, scene)
      if (any(self%trait%is_corotated)) allocate(self%x, source=scene%x)
      call init_laws(self, scene, at_rest, error, user)
      if (allocated(error)) return
      call init_kinds(self, scene, mass, error)
      if (allocated(error)) return
      allocate(self%law_of(n), self%thickness(n))
      do e = 1, n
         k = scene%section(scene%element%section(e))%material
         self%law_of(e) = k + merge(size(self%law)/2, 0, self%trait%is_thin(e))
         self%thickness(e) = scene%section(scene%element%section(e))%thickness
      end do
      self%trait%n_node = [(self%shape(self%kind(e))%table%n_node, e = 1, n)]
      self%trait%n_point = [(self%shape(self%kind(e))%table%n_gp, e = 1, n)]
      call lay_out_packs(self)
      do e = 1, n
         k = self%law_of(e)
         if (self%trait%is_small(e)) self%law_of(e) = size(scene%material) + k
         call init_element(self, scene, e, at_rest(k), mass(self%kind(e)), error)
         if (allocated(error)) return
      end do
      call divide_laws(self, scene, error)
      if (allocated(error)) return
      call number_points(self)
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
         // "COUPLED NEO HOOKE, MOONEY-RIVLIN or YEOH, or plane strain, CPE")
   end subroutine check_law

   !> The incompatible modes of element `e`, by the moduli of its law at rest.
   subroutine make_modes(self, e, geometry, error)
      type(solid_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element
      type(element_geometry_t), intent(inout) :: geometry      !! of it
      type(error_t), allocatable, intent(out) :: error
      real(wp), parameter :: rest(n_strain) = 0.0_wp
      type(law_response_t) :: plane
      type(space_response_t) :: space

      if (self%trait%is_rigid(e)) return
      associate (law => self%law(self%law_of(e)), table => self%shape(self%kind(e))%table)
         if (.not. allocated(law%law)) then
            call raise(error, err_input, "element " // to_text(self%deck%label(e)) // " has " &
               // "incompatible modes, for which the law given for material " &
               // self%deck%material(1 + mod(self%law_of(e) - 1, size(self%deck%material)))%text &
               // " tells no moduli; take " // trim(merge("C3D8 or C3D20", "CPE4 or CPE8 ", &
               self%n_dim == n_space)))
         else if (self%n_dim == n_space) then
            call law_response_space(law%law, rest, rest, space)
            call modes_init(geometry, table, space%tangent)
         else
            call law_response_plane(law%law, rest(:3), rest(:3), plane)
            call modes_init(geometry, table, plane%tangent)
         end if
      end associate
   end subroutine make_modes

   !> What laws are without their resistance to a change of volume, where elements ask for it.
   subroutine divide_laws(self, scene, error)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), allocatable, intent(out) :: error
      integer :: e, k

      allocate(self%rest(size(self%law)))
      do e = 1, self%n_element
         k = self%law_of(e)
         if (.not. self%trait%has_mean(e) .or. self%trait%is_rigid(e) &
            .or. allocated(self%rest(k)%law)) cycle
         if (allocated(self%law(k)%law)) call self%law(k)%law%divide(self%rest(k)%law)
         if (allocated(self%rest(k)%law)) cycle
         call raise(error, err_input, where_text(scene, scene%element%origin(e)) // ": error: " &
            // "element " // to_text(self%deck%label(e)) // " is of type " &
            // trim(scene%element%kinds(self%kind(e))%name) // ", which takes the mean change of " &
            // "volume; the law given for material " // self%deck%material(k)%text &
            // " cannot be split in this way; take " // trim(merge("C3D8 or C3D20", &
            "CPE4 or CPE8 ", self%n_dim == n_space)))
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
         self%trait%is_corotated(self%n_element), self%trait%has_modes(self%n_element))
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
            self%trait%has_modes(e) = kind%has_modes .and. is_free
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

   !> Pack the elements of each kind and law, as they come in the scene: where each of them is held.
   pure subroutine lay_out_packs(self)
      type(solid_t), intent(inout) :: self
      integer :: list(self%n_element), e, i, k, law, n, n_pack, n_single, pass
      logical :: is_single(self%n_element)

      is_single = self%is_of_rings .or. self%trait%is_small .or. self%trait%is_rigid
      allocate(self%held%at(self%n_element), source=0)
      n_single = 0
      do e = 1, self%n_element
         if (.not. is_single(e)) cycle
         n_single = n_single + 1
         self%held%at(e) = -n_single
      end do
      allocate(self%held%single(n_single))
      do pass = 1, 2                             ! count, then begin
         n_pack = 0
         do k = 1, maxval([0, self%kind])
            do law = 1, size(self%law)
               n = 0
               do e = 1, self%n_element
                  if (is_single(e) .or. self%kind(e) /= k .or. self%law_of(e) /= law) cycle
                  n = n + 1
                  list(n) = e
               end do
               do i = 1, n, n_lane
                  n_pack = n_pack + 1
                  if (pass == 2) call pack_begin(self%pack(n_pack), min(n_lane, n - i + 1), k, law)
               end do
               if (pass == 2) self%held%at(list(:n)) = n_lane*(n_pack - (n + n_lane - 1)/n_lane) &
                  + [(i, i = 1, n)]
            end do
         end do
         if (pass == 1) allocate(self%pack(n_pack))
      end do
   end subroutine lay_out_packs

   !> Keep the geometry of element `e`.
   pure subroutine hold_geometry(self, e, x, geometry)
      type(solid_t), intent(inout) :: self
      integer, intent(in) :: e                   !! 1..n_element, ascending
      real(wp), intent(in) :: x(:, :)            !! (n_dim, nodes of it) from the first of them [L]
      type(element_geometry_t), intent(in) :: geometry

      associate (at => self%held%at(e))
         if (at < 0) then
            self%held%single(-at) = geometry
         else
            call pack_put(self%pack(1 + (at - 1)/n_lane), 1 + mod(at - 1, n_lane), e, &
               self%node(:size(x, 2), e), geometry, x)
         end if
      end associate
   end subroutine hold_geometry

   !> Gradients and volumes at the points of element `e`.
   pure subroutine solid_geometry(self, e, geometry)
      type(solid_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1..n_element
      type(element_geometry_t), intent(out) :: geometry
      real(wp), allocatable :: local(:, :)

      associate (at => self%held%at(e))
         if (at < 0) then
            geometry = self%held%single(-at)
         else
            call pack_geometry(self%pack(1 + (at - 1)/n_lane), 1 + mod(at - 1, n_lane), geometry, &
               local)
            if (allocated(local)) call space_element_place(geometry, &
               self%shape(self%kind(e))%table, local)
         end if
      end associate
   end subroutine solid_geometry

   !> What the shapes of the kinds say, of those that elements have.
   subroutine init_kinds(self, scene, mass, error)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(shape_table_t), intent(inout) :: mass(:)      !! (n_kind)
      type(error_t), allocatable, intent(out) :: error
      integer :: k, e

      allocate(self%shape(size(scene%element%kinds)))
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
            call shape_tabulate(kind%shape, .false., self%shape(k)%table)
            call shape_tabulate(kind%shape, .true., mass(k))
            call kind%shape%to_nodes(self%shape(k)%to_nodes)
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
            self%host%n_point(k) = self%host%n_point(k) + self%trait%n_point(e)
         end associate
      end do
      self%host%is_used = any(self%host%n_point > 0)
   end subroutine number_points

   !> Geometry, mass and stiffness at rest of element `e`.
   subroutine init_element(self, scene, e, at_rest, mass, error)
      type(solid_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: e                   !! 1..n_element, ascending
      real(wp), intent(in) :: at_rest            !! largest entry of its law's tangent [M/(L T^2)]
      type(shape_table_t), intent(in) :: mass    !! of its kind, for mass
      type(error_t), allocatable, intent(out) :: error
      type(element_geometry_t) :: geometry
      real(wp) :: x(size(scene%x, 1), self%trait%n_node(e)), density
      integer :: i

      do i = 1, size(x, 2)
         x(:, i) = scene%x(:, self%node(i, e)) - scene%x(:, self%node(1, e))
      end do
      density = scene%material(scene%section(scene%element%section(e))%material)%density
      if (self%n_dim == n_space) then
         call place_in_space(self, e, x, density, mass, geometry)
      else
         call place_in_plane(self, scene%x, e, x, geometry)
         call add_mass(self, scene%x, e, x, density, mass)
      end if
      if (.not. self%trait%is_rigid(e)) call estimate_stiffness(self, geometry, at_rest, e)
      call check_law(self, scene, e, error)
      if (allocated(error)) return
      if (self%trait%has_modes(e)) call make_modes(self, e, geometry, error)
      if (allocated(error)) return
      if (any(geometry%weight <= 0.0_wp)) then
         call raise(error, err_input, "element " // to_text(scene%element%label(e)) // &
            " is inverted or has no " // trim(merge("volume", "area  ", self%n_dim == n_space)) &
            // "; check the order of its nodes")
         return
      end if
      call hold_geometry(self, e, x, geometry)
   end subroutine init_element

   !> Geometry and mass of element `e` of space.
   pure subroutine place_in_space(self, e, local, density, mass, geometry)
      type(solid_t), intent(inout) :: self
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: local(:, :)        !! (3, n) places of its nodes [L]
      real(wp), intent(in) :: density            !! [M/L^3]
      type(shape_table_t), intent(in) :: mass    !! of its kind, for mass
      type(element_geometry_t), intent(out) :: geometry
      real(wp) :: consistent(size(local, 2), size(local, 2))
      integer :: n

      n = size(local, 2)
      call space_element_place(geometry, self%shape(self%kind(e))%table, local)
      call space_element_add_mass(mass, local, density, consistent, self%mass%of_volume(:n, e))
      if (self%trait%has_inertia(e)) self%mass%consistent(:n, :n, e) = consistent
   end subroutine place_in_space

   !> Geometry of element `e` of the plane.
   pure subroutine place_in_plane(self, x, e, local, geometry)
      type(solid_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: local(:, :)        !! (2, n) of its nodes, from the first one [L]
      type(element_geometry_t), intent(out) :: geometry
      real(wp) :: gradient(size(local, 1), size(local, 2)), det, depth
      integer :: k, n

      n = size(local, 2)
      associate (table => self%shape(self%kind(e))%table)
         geometry%n_node = n
         geometry%n_gp = table%n_gp
         allocate(geometry%gradient(size(x, 1), n, table%n_gp), geometry%weight(table%n_gp))
         if (self%is_of_rings) allocate(geometry%circle(n, table%n_gp))
         do k = 1, table%n_gp
            call reference_gradient(n, local, table%slope(:, :, k), gradient, det)
            call find_depth(self, e, x, table%value(:, k), depth)
            geometry%gradient(:, :, k) = gradient
            geometry%weight(k) = table%weight(k)*det*depth
            if (self%is_of_rings) geometry%circle(:, k) = table%value(:, k)*(two_pi/depth)
         end do
      end associate
   end subroutine place_in_plane

   !> Mass of element `e` of the plane.
   pure subroutine add_mass(self, x, e, local, density, mass)
      type(solid_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      integer, intent(in) :: e                   !! 1..n_element
      real(wp), intent(in) :: local(:, :)        !! (2, n) of its nodes, from the first one [L]
      real(wp), intent(in) :: density            !! [M/L^3]
      type(shape_table_t), intent(in) :: mass    !! of its kind, for mass
      real(wp) :: gradient(size(local, 1), size(local, 2)), det, rho_dv, depth
      integer :: n, k, i

      n = size(local, 2)
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
   end subroutine add_mass

   !> How deep a point is: the thickness, or the length of its circle.
   pure subroutine find_depth(self, e, x, value, depth)
      type(solid_t), intent(in) :: self
      integer, intent(in) :: e                   !! 1 to n_element
      real(wp), intent(in) :: x(:, :)            !! (2, n_node) [L]
      real(wp), intent(in) :: value(:)           !! shape functions at the point
      real(wp), intent(out) :: depth             !! [L]

      depth = self%thickness(e)
      if (self%is_of_rings) depth = two_pi*dot_product(value, x(1, self%node(:size(value), e)))
   end subroutine find_depth

   !> A displacement u rounds the strain by epsilon |grad N| |u|, however small the strain is; what
   !> force that makes follows from the law's stiffness at rest: docs/theory.md, eq. (26).
   pure subroutine estimate_stiffness(self, geometry, at_rest, e)
      type(solid_t), intent(inout) :: self
      type(element_geometry_t), intent(in) :: geometry     !! of element `e`
      real(wp), intent(in) :: at_rest            !! largest entry of the tangent [M/(L T^2)]
      integer, intent(in) :: e                   !! 1..n_element
      real(wp) :: spread, by(geometry%n_node)
      integer :: k, i

      do k = 1, geometry%n_gp
         by = 0.0_wp
         if (self%is_of_rings) by = abs(geometry%circle(:, k))
         spread = geometry%weight(k)*at_rest*(sum(abs(geometry%gradient(:, :, k))) + sum(by))
         do i = 1, geometry%n_node
            self%stiffness(i, e) = self%stiffness(i, e) &
               + spread*(sum(abs(geometry%gradient(:, i, k))) + by(i))
         end do
      end do
   end subroutine estimate_stiffness

end module emcon_solid
