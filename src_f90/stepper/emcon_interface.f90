!> Contact and ties for a host code that has its own solids: nodes, surfaces as edges, pairs, ties.
!>
!> The host builds an `interface_t` once: `interface_init`, surfaces, pairs and ties,
!> `interface_prepare`. What it then asks for in each step: emcon_interface_step. Nodes are numbered
!> 1..n_node by the host; nodes that no surface holds may be left out. Degree of freedom a of node
!> i is 2 (i - 1) + a. Edges run with the body to the left, so the outward normal is the edge turned
!> by -90 degrees. The plane has thickness 1. Nothing here knows of the host's elements or solver.
!>
!> Rigid obstacles are surfaces of held nodes. Source: docs/theory.md, sections 4, 5 and 11.
module emcon_interface
   use emcon_active_set, only : active_set_init, active_set_t
   use emcon_chain, only : chain_init, chain_t
   use emcon_contact_registry, only : new_contact
   use emcon_couplings, only : tie_t
   use emcon_csr, only : csr_from_entries, csr_t
   use emcon_element_registry, only : element_kinds_create
   use emcon_errors, only : error_t
   use emcon_interactions, only : contact_options_t, multiplier_dual, multiplier_standard, &
      contact_pair_t
   use emcon_interface_check, only : check_choice, check_edges, check_field, check_number, &
      check_options, check_pairs, check_surfaces, name_place, refuse
   use emcon_kinds, only : dp, wp
   use emcon_linear_rows, only : linear_rows_init, linear_rows_t
   use emcon_mesh, only : surface_t
   use emcon_motion, only : motion_init, motion_t
   use emcon_null_space, only : null_space_t
   use emcon_numbering, only : gather_dependent, numbering_init, numbering_matrix, numbering_t, &
      spread_dependent, unresolved_t
   use emcon_scene, only : scene_t
   use emcon_space, only : space_t
   use emcon_sort, only : find_sorted
   use emcon_state, only : state_t
   use emcon_steps, only : initiation_admissible, initiation_persistent, prescribed_t
   use emcon_system, only : system_t
   use emcon_text, only : note_add, notes_t, to_text
   use emcon_ties, only : ties_prepare
   implicit none
   private
   public :: interface_t, interface_init, interface_add_surface, interface_add_pair, &
      interface_add_tie, interface_prepare, interface_tie_matrices, interface_links, &
      interface_follow, interface_gather

   !> Read it freely; what is to be set by the host is named as such.
   type :: interface_t
      integer :: n_node = 0
      integer :: n_constraint = 0                !! possible contacts: slave nodes of all pairs
      integer :: n_unknown = 0                   !! freedoms neither held nor tied to others
      !> To be set, also between steps: `initiation_persistent` holds the gap that the step starts
      !> from, which keeps energy; `initiation_admissible` closes it.
      integer :: initiation = initiation_persistent
      !> To be set: no contact begins with a larger gap per edge than this; 0: any.
      real(wp) :: gap_tolerance = 0.0_wp
      !> To be set: the host can try a step again in smaller parts.
      logical :: may_cut = .true.
      !> To be set: statics, gradients at the end of the step, where new contacts are closed. With
      !> this set at `interface_prepare`, corners are those of decks with static steps.
      logical :: is_end = .false.
      integer :: first = 1                       !! number of the first node, surface, pair in texts
      real(wp) :: largest_move = 0.0_wp          !! of a slave node onto its master by a tie [L]
      type(notes_t) :: notes                     !! remarks on the ties
      logical :: is_prepared = .false.
      logical :: has_stencils = .false.          !! a step was begun
      type(scene_t) :: scene                     !! `scene%x`: positions, after `interface_prepare`
                                                 !! those that fulfil the ties [L]
      type(contact_options_t), allocatable :: options(:)   !! (n_pair)
      type(system_t) :: system                   !! contacts; `numbering` has all freedoms
      type(numbering_t) :: linked                !! unknowns, u = T w
      type(active_set_t) :: active
      type(state_t) :: state                     !! start of the step
      type(motion_t) :: motion                   !! as last handed over
      type(null_space_t) :: space
   end type interface_t

contains

   !> Begin with the nodes of the host. Errors: shape, numbers that are not finite.
   subroutine interface_init(self, x, error, first)
      type(interface_t), intent(out) :: self
      real(wp), intent(in) :: x(:, :)                      !! (2, n_node) reference positions [L]
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: first               !! number that texts begin with; else 1
      integer :: i

      if (present(first)) self%first = first
      call check_field(error, "interface_init", "x", x, -1)
      if (allocated(error)) return
      if (size(x, 2) == 0) then
         call refuse(error, "interface_init", "x has no nodes")
         return
      end if
      self%n_node = size(x, 2)
      associate (scene => self%scene)
         scene%heading = ""
         allocate(scene%x, source=x)
         allocate(scene%u0(2, self%n_node), scene%v0(2, self%n_node), source=0.0_wp)
         allocate(scene%node_label(self%n_node), &
            source=[(self%first + i, i = 0, self%n_node - 1)])
         allocate(scene%file(0), scene%node_origin(self%n_node), scene%element_origin(0))
         allocate(scene%element_label(0), scene%element_kind(0), scene%element_section(0))
         call element_kinds_create(scene%kind)
         allocate(scene%element_node(0, 0))
         allocate(scene%node_set(0), scene%element_set(0), scene%surface(0), scene%amplitude(0))
         allocate(scene%material(0), scene%section(0), scene%pair(0), scene%tie(0))
         allocate(scene%equation(0), scene%step(1))
         allocate(scene%step(1)%prescribed(0), scene%step(1)%load(0), scene%step(1)%output(0))
      end associate
      allocate(self%options(0))
   end subroutine interface_init

   !> Add a surface: edges in any order, in one or several connected parts, open or closed.
   !>
   !> Errors: nodes that do not exist, edges without length, a node with more than two edges or
   !> with two that begin there.
   subroutine interface_add_surface(self, name, edge, i_surface, error)
      type(interface_t), intent(inout) :: self
      character(len=*), intent(in) :: name                 !! for messages
      integer, intent(in) :: edge(:, :)                    !! (2, n_edge) first and last node
      integer, intent(out) :: i_surface                    !! its number, from 1
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_add_surface"
      type(surface_t) :: surface
      type(chain_t) :: chain

      i_surface = 0
      call check_stage(self, place, .false., error)
      if (.not. allocated(error)) call check_edges(error, place // " " // name, edge, self%scene%x)
      if (allocated(error)) return
      surface%name = name
      allocate(surface%element(0), surface%face(0))
      allocate(surface%edge, source=edge)
      call chain_init(chain, self%scene, surface, error)
      call name_place(error, place)
      if (allocated(error)) return
      self%scene%surface = [self%scene%surface, surface]
      i_surface = size(self%scene%surface)
   end subroutine interface_add_surface

   !> Add a contact pair; a surface in contact with itself is its own master.
   subroutine interface_add_pair(self, slave, master, formulation, options, error)
      type(interface_t), intent(inout) :: self
      integer, intent(in) :: slave, master                 !! numbers of surfaces
      integer, intent(in) :: formulation                   !! one of `formulation_` of emcon_scene
      type(contact_options_t), intent(in) :: options
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_add_pair"
      type(contact_pair_t) :: pair

      call check_stage(self, place, .false., error)
      call check_surfaces(error, place, size(self%scene%surface), slave, master)
      call check_options(error, place, formulation, options)
      if (allocated(error)) return
      pair%slave = slave
      pair%master = master
      pair%formulation = formulation
      self%scene%pair = [self%scene%pair, pair]
      self%options = [self%options, options]
   end subroutine interface_add_pair

   !> Add a tie of two surfaces that meet, whatever their meshes.
   subroutine interface_add_tie(self, slave, master, multiplier, tolerance, error)
      type(interface_t), intent(inout) :: self
      integer, intent(in) :: slave, master                 !! numbers of surfaces
      integer, intent(in) :: multiplier                    !! one of `multiplier_` of emcon_scene
      real(wp), intent(in) :: tolerance                    !! how far apart [L]; < 0: a tenth of an
                                                           !! edge
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_add_tie"
      type(tie_t) :: tie

      call check_stage(self, place, .false., error)
      call check_surfaces(error, place, size(self%scene%surface), slave, master)
      call check_choice(error, place, "multiplier", multiplier, multiplier_standard, &
         multiplier_dual)
      call check_number(error, place, "tolerance", tolerance)
      if (.not. allocated(error) .and. slave == master) call refuse(error, place, &
         "slave and master are both surface " // self%scene%surface(slave)%name)
      if (allocated(error)) return
      tie%name = to_text(size(self%scene%tie) + self%first) // " (" // &
         self%scene%surface(slave)%name // " on " // self%scene%surface(master)%name // ")"
      tie%slave = slave
      tie%master = master
      tie%multiplier = multiplier
      tie%tolerance = tolerance
      self%scene%tie = [self%scene%tie, tie]
   end subroutine interface_add_tie

   !> Finish: integrals of the ties, and their slave nodes moved onto the masters so that
   !> D x_s = M x_m; the host takes over `scene%x`. `held`: freedoms that the host moves by itself.
   !>
   !> Errors: surfaces of a tie that do not meet; pairs with common nodes; a call out of order.
   subroutine interface_prepare(self, held, error)
      type(interface_t), intent(inout) :: self
      logical, intent(in) :: held(:, :)                    !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: place = "interface_prepare"
      real(wp), allocatable :: x(:, :)

      call check_stage(self, place, .false., error)
      if (allocated(error)) return
      if (any(shape(held) /= [2, self%n_node])) then
         call refuse(error, place, "held has the shape (" // to_text(size(held, 1)) // ", " // &
            to_text(size(held, 2)) // "), not (2, " // to_text(self%n_node) // ")")
      else if (size(self%scene%pair) + size(self%scene%tie) == 0) then
         call refuse(error, place, "there is neither a pair nor a tie")
      end if
      call check_pairs(error, place, self%scene)
      if (allocated(error)) return
      call hold(self%scene, held)
      allocate(x, source=self%scene%x)
      call ties_prepare(self%scene, self%notes, error)
      if (.not. allocated(error)) call init_links(self)
      if (.not. allocated(error)) call init_contact(self, error)
      call name_place(error, place)
      if (allocated(error)) then
         self%scene%x = x                                  ! may be called again
         return
      end if
      self%largest_move = maxval(norm2(self%scene%x - x, 1))
      self%is_prepared = .true.
   end subroutine interface_prepare

   !> Held freedoms as prescribed ones.
   pure subroutine hold(scene, held)
      type(scene_t), intent(inout) :: scene
      logical, intent(in) :: held(:, :)
      type(prescribed_t) :: one
      integer :: a, i, k

      deallocate(scene%step(1)%prescribed)
      allocate(scene%step(1)%prescribed(count(held)))
      k = 0
      do i = 1, size(held, 2)
         do a = 1, 2
            if (.not. held(a, i)) cycle
            k = k + 1
            one%node = i
            one%dof = a
            scene%step(1)%prescribed(k) = one
         end do
      end do
   end subroutine hold

   !> Number the unknowns, once all freedoms and once less those held or tied to others.
   subroutine init_links(self)
      type(interface_t), intent(inout) :: self
      type(linear_rows_t) :: linear
      type(unresolved_t), allocatable :: unresolved(:)
      type(prescribed_t) :: nothing(0)
      logical, allocatable :: is_alive(:, :)
      integer :: t, n

      allocate(is_alive(2, self%n_node), source=.true.)
      call linear_rows_init(linear, self%scene)
      call numbering_init(self%linked, is_alive, self%scene%step(1)%prescribed, linear, unresolved)
      call numbering_init(self%system%space%numbering, is_alive, nothing)
      self%n_unknown = self%linked%n_unknown
      do t = 1, size(self%scene%tie)
         n = count(linear%tie(unresolved%row) == t)
         if (n > 0) call note_add(self%notes, "tie " // self%scene%tie(t)%name // ": " // &
            to_text(n) // " of its rows follow from others or bind held freedoms only, and " // &
            "are left out")
      end do
   end subroutine init_links

   !> The contacts, and what the constraint set and the active set work on.
   subroutine init_contact(self, error)
      type(interface_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      associate (system => self%system, scene => self%scene)
         system = system_t(space=space_t(numbering=self%system%space%numbering))
         allocate(system%linear%is_used(0))
         allocate(system%contact(size(scene%pair)), system%held(0))
         allocate(system%first_constraint(size(scene%pair) + 1), source=0)
         do i = 1, size(scene%pair)
            call new_contact(scene, scene%pair(i), system%contact(i)%contact, error)
            if (allocated(error)) return
            associate (contact => system%contact(i)%contact)
               call contact%suit_steps(self%is_end)
               call contact%configure(scene%x, self%options(i))
               system%n_constraint = system%n_constraint + contact%n_constraint
            end associate
            system%first_constraint(i + 1) = system%n_constraint
         end do
         allocate(system%response%magnitude(2, self%n_node), source=0.0_wp)
         call motion_init(self%motion, scene%x)
         self%n_constraint = system%n_constraint
      end associate
      call active_set_init(self%active, self%system)
      allocate(self%state%u(2, self%n_node), self%state%lam(self%n_constraint), source=0.0_wp)
      allocate(self%state%is_active(self%n_constraint), source=.false.)
   end subroutine init_contact

   !> D and M of tie `t`, over nodes: D x = M x in both directions. A row for each multiplier.
   subroutine interface_tie_matrices(self, t, d, m, error)
      type(interface_t), intent(in) :: self
      integer, intent(in) :: t                             !! in the order of `interface_add_tie`
      type(csr_t), intent(out) :: d, m                     !! (n_row x n_node) [L]
      type(error_t), allocatable, intent(out) :: error
      type(chain_t) :: slave
      integer, allocatable :: row(:), column(:), slot(:)
      logical, allocatable :: is_slave(:)
      integer :: k, s

      call check_stage(self, "interface_tie_matrices", .true., error)
      call check_choice(error, "interface_tie_matrices", "t", t, 1, size(self%scene%tie))
      if (allocated(error)) return
      call chain_init(slave, self%scene, self%scene%surface(self%scene%tie(t)%slave), error)
      if (allocated(error)) return
      associate (rows => self%scene%tie(t)%rows)
         allocate(row(size(rows%node)), is_slave(size(rows%node)))
         do k = 1, size(rows%slave)
            row(rows%start(k) + 1:rows%start(k + 1)) = k
         end do
         do s = 1, size(rows%node)
            is_slave(s) = find_sorted(slave%node, rows%node(s)) > 0
         end do
         column = merge(rows%node, 0, is_slave)
         call csr_from_entries(d, size(rows%slave), self%n_node, row, column, slot)
         call fill(d, slot, rows%weight)
         column = merge(0, rows%node, is_slave)
         call csr_from_entries(m, size(rows%slave), self%n_node, row, column, slot)
         call fill(m, slot, -rows%weight)
      end associate
   end subroutine interface_tie_matrices

   pure subroutine fill(matrix, slot, weight)
      type(csr_t), intent(inout) :: matrix
      integer, intent(in) :: slot(:)
      real(wp), intent(in) :: weight(:)
      integer :: s

      do s = 1, size(slot)
         if (slot(s) > 0) matrix%value(slot(s)) = matrix%value(slot(s)) + real(weight(s), dp)
      end do
   end subroutine fill

   !> T of u = T w, w the unknowns: T^T r is the residual on them, T^T K T the tangent. Rows of held
   !> freedoms are empty; where these move, `interface_follow` lets tied ones follow.
   subroutine interface_links(self, matrix, error)
      type(interface_t), intent(in) :: self
      type(csr_t), intent(out) :: matrix                   !! (2 n_node x n_unknown)
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call check_stage(self, "interface_links", .true., error)
      if (allocated(error)) return
      call numbering_matrix(self%linked, [(i, i = 1, 2*self%n_node)], matrix)
   end subroutine interface_links

   !> Tied freedoms of a displacement or velocity from those that they follow.
   subroutine interface_follow(self, field, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(inout) :: field(:, :)               !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call check_stage(self, "interface_follow", .true., error)
      call check_field(error, "interface_follow", "field", field, self%n_node)
      if (.not. allocated(error)) call spread_dependent(self%linked, field)
   end subroutine interface_follow

   !> Forces on tied freedoms go to those that they follow.
   subroutine interface_gather(self, field, error)
      type(interface_t), intent(in) :: self
      real(wp), intent(inout) :: field(:, :)               !! (2, n_node)
      type(error_t), allocatable, intent(out) :: error

      call check_stage(self, "interface_gather", .true., error)
      call check_field(error, "interface_gather", "field", field, self%n_node)
      if (.not. allocated(error)) call gather_dependent(self%linked, field)
   end subroutine interface_gather

   !> An error if the interface is not at the stage that a call needs.
   pure subroutine check_stage(self, place, is_prepared, error)
      type(interface_t), intent(in) :: self
      character(len=*), intent(in) :: place
      logical, intent(in) :: is_prepared
      type(error_t), allocatable, intent(out) :: error

      if (self%n_node == 0) then
         call refuse(error, place, "called before interface_init")
      else if (is_prepared .and. .not. self%is_prepared) then
         call refuse(error, place, "called before interface_prepare")
      else if (self%is_prepared .and. .not. is_prepared) then
         call refuse(error, place, "called after interface_prepare; begin anew with interface_init")
      end if
   end subroutine check_stage

end module emcon_interface
